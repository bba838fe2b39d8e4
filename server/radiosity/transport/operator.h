#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/transport/channels.h"

namespace radbake::radiosity {

/// The form factors between patches, as an operator: geometry only, so another light needs no new rays.
///
/// Rows serve gathering, columns shooting. Of a stored operator both are of one matrix: F_ij of row(i) and of column(j)
/// are equal bits. Of a streamed one they are two estimates.
class TransportOperator {
 public:
  virtual ~TransportOperator() = default;

  /// A row F_i*: patches and form factors, ascending. Replaces what the vectors hold.
  virtual void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const = 0;

  /// A column F_*j: what patch j sends to each, as the share of light that the receivers send to j. Ascending by
  /// receiver; replaces what the vectors hold. Where the matrix is reciprocal, F_ij = A_j F_ji / A_i.
  virtual void column(std::uint32_t j, std::vector<std::uint32_t>& patches,
                      std::vector<double>& form_factors) const = 0;

  /// H_i = sum_j F_ij B_j for one patch. Shapes: radiosity [n].
  virtual Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const = 0;
  /// One channel of it: the bits that each of three equal ones gets.
  virtual double gather_at(std::uint32_t i, std::span<const double> radiosity) const = 0;

  /// sum_j F_ij
  virtual double row_sum(std::uint32_t i) const = 0;

  /// Entries of a row, for rounding bounds.
  virtual std::size_t row_length(std::uint32_t i) const = 0;

  /// Areas of the patches, as far as they are visible; A_i F_ij = A_j F_ji. Shapes: [n].
  virtual std::span<const double> areas() const = 0;

  /// H = F B for all patches, rows side by side on the threads; each row is gather_at's, bit for bit.
  /// Shapes: both [n], not the same array.
  virtual void gather(std::span<const Vec3> radiosity, std::span<Vec3> irradiance) const;
  virtual void gather(std::span<const double> radiosity, std::span<double> irradiance) const;

  /// Whether A_i F_ij = A_j F_ji, up to rounding, may be relied on.
  virtual bool is_reciprocal() const { return true; }
  /// Whether rows and columns are of one matrix, bit for bit.
  virtual bool is_one_matrix() const { return true; }
  /// Whether the matrix is known by its columns only: gather_at() and row() are then not of it, gather() and column()
  /// are, and what bounds an error is that sum_i A_i F_ij <= A_j.
  virtual bool is_by_columns() const { return false; }
  /// Rows that are worth a task of their own.
  virtual std::size_t rows_per_task() const { return 256; }

  std::size_t size() const { return areas().size(); }
};

}  // namespace radbake::radiosity
