#pragma once

#include <memory>
#include <stop_token>

#include "server/radiosity/transport/estimated_rows.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// What the estimated rows were like and what their repair did. Field for field TransportSummary of the report.
struct TransportRepair {
  std::uint64_t num_entries = 0;
  double raw_reciprocity_rms = 0;
  double raw_closure_max = 0;
  double paired_row_error_rms = 0;
  double repaired_row_error_max = 0;
  int scaling_sweeps = 0;
  double escape_share = 0;
  double absorbed_share = 0;
};

/// Estimated rows as one reciprocal matrix in compressed rows.
///
/// A_i F_ij and A_j F_ji are two estimates of one number, S_ij, with variances A_i S_ij / N_i and A_j S_ij / N_j.
/// Their average with inverse variances as weights is
///
///   S_ij = (w_ij + w_ji) / (N_i / A_i + N_j / A_j)          w: rays that arrived, N: rays of the row
///
/// A symmetric scaling F_ij = d_i S_ij d_j / A_i then restores the measured row sums r_i = 1 - (escaped +
/// absorbed)/N_i: exactly where such a scaling exists (closed scenes), else as near as its fixed point comes. Rows that
/// it leaves with other sums (few rays tell of impossible exchanges) are then scaled by themselves, and the matrix is
/// not reciprocal there: a row that passes on more than it gets diverges, one that passes on less darkens what it
/// lights. Cost: O(entries) memory, 8 bytes each; O(entries) a scaling sweep. Source: Knight, Ruiz & Ucar 2014
/// (symmetric scaling); van Leersum 1989 (why row sums and reciprocity both matter).
class SparseOperator final : public TransportOperator {
 public:
  /// Row sums that are off by rounding only; sweeps end there.
  static constexpr double kExact = 1e-14;

  /// `tolerance`: how far off row sums may be left, as a share. Stopped early, the operator means nothing.
  explicit SparseOperator(const EstimatedRows& rows, const std::stop_token& stop = {}, double tolerance = kExact);

  const TransportRepair& repair() const { return repair_; }

  /// S_ij of one row: patches and exchange areas before the scaling, ascending. Symmetric, bit for bit.
  struct ExchangeRow {
    std::span<const std::uint32_t> patches;
    std::span<const float> exchange;
  };
  ExchangeRow exchange_row(std::uint32_t i) const;
  /// d of F_ij = d_i S_ij d_j / q_i. Shapes: [n].
  std::span<const double> scaling() const { return scale_; }
  /// q of F_ij = d_i S_ij d_j / q_i: A_i, but where a row was scaled by itself. Shapes: [n].
  std::span<const double> divisors() const { return divisors_; }

  void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  void column(std::uint32_t j, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const override { return gathered(i, radiosity); }
  double gather_at(std::uint32_t i, std::span<const double> radiosity) const override { return gathered(i, radiosity); }
  double row_sum(std::uint32_t i) const override;
  std::size_t row_length(std::uint32_t i) const override { return first_[i + 1] - first_[i]; }
  std::span<const double> areas() const override { return areas_; }
  bool is_reciprocal() const override { return is_reciprocal_; }

 private:
  void pair_estimates(const EstimatedRows& rows, const std::stop_token& stop);
  void restore_row_sums(const EstimatedRows& rows, const std::stop_token& stop, double tolerance);
  double scaled_row(std::uint32_t i) const;
  template <Channels C>
  C gathered(std::uint32_t i, std::span<const C> radiosity) const;

  std::vector<std::uint64_t> first_;
  std::vector<std::uint32_t> patches_;
  std::vector<float> exchange_;  ///< S_ij
  std::vector<double> scale_;    ///< d_i
  std::vector<double> areas_;
  std::vector<double> divisors_;  ///< q_i
  bool is_reciprocal_ = true;
  TransportRepair repair_;
};

}  // namespace radbake::radiosity
