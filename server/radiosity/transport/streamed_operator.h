#pragma once

#include <functional>

#include "server/radiosity/transport/estimated_rows.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// Estimates the row of a patch anew: the same bits each time, from any thread. Replaces what the vector holds; leaves
/// it empty where the bake was cancelled.
using RowSource = std::function<void(std::uint32_t patch, std::vector<EstimatedRows::Entry>& entries)>;

/// What is kept of a row when its entries are discarded.
struct RowSums {
  std::vector<double> measured;        ///< [n] what each row sums to
  std::vector<std::uint32_t> lengths;  ///< [n] entries
  std::vector<double> areas;           ///< [n] visible areas
};

/// Which of the two systems a streamed operator stands for: they agree within sampling error only.
enum class StreamedSystem {
  kByRows,     ///< F_ij of row i: for methods that gather
  kByColumns,  ///< F_ij = (A_j / A_i) F_ji of row j: for methods that shoot
};

/// The form factors one row at a time: estimated, used and discarded, so that memory does not grow with the rows.
///
/// The two estimates of an exchange, A_i F_ij and A_j F_ji, cannot be paired, so the operator stands for one of two
/// systems. Rows are scaled to their measured sums (by rays they have them already).
/// Cost: each row(), column() and gather_at() estimates one row, a gather all of them. 24 bytes a patch.
/// Source: Cohen, Chen, Wallace & Greenberg 1988 (one hemicube at a time).
class StreamedOperator final : public TransportOperator {
 public:
  StreamedOperator(RowSums sums, RowSource source, StreamedSystem system)
      : sums_(std::move(sums)), source_(std::move(source)), system_(system) {}

  /// As estimated in row i, whichever the system is.
  void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  /// F_ij = (A_j / A_i) F_ji of row j, whichever the system is.
  void column(std::uint32_t j, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  /// With row i. Precondition: the system is by rows (checked).
  Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const override { return gathered(i, radiosity); }
  double gather_at(std::uint32_t i, std::span<const double> radiosity) const override { return gathered(i, radiosity); }
  /// By columns: each row estimated once and scattered, in order.
  void gather(std::span<const Vec3> radiosity, std::span<Vec3> irradiance) const override;
  void gather(std::span<const double> radiosity, std::span<double> irradiance) const override;
  /// Of row i as it was measured.
  double row_sum(std::uint32_t i) const override { return sums_.measured[i]; }
  std::size_t row_length(std::uint32_t i) const override { return sums_.lengths[i]; }
  std::span<const double> areas() const override { return sums_.areas; }
  bool is_reciprocal() const override { return false; }
  bool is_one_matrix() const override { return false; }
  bool is_by_columns() const override { return system_ == StreamedSystem::kByColumns; }
  std::size_t rows_per_task() const override { return 4; }

 private:
  /// The entries of row i and what each weight counts.
  double estimate(std::uint32_t i, std::vector<EstimatedRows::Entry>& entries) const;
  template <Channels C>
  C gathered(std::uint32_t i, std::span<const C> radiosity) const;
  template <Channels C>
  void scatter_columns(std::span<const C> radiosity, std::span<C> irradiance) const;

  RowSums sums_;
  RowSource source_;
  StreamedSystem system_;
};

}  // namespace radbake::radiosity
