#pragma once

#include "common/base/result.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

class SparseOperator;

/// The form factors written out, n x n, for small scenes and for matrices that are given.
///
/// Made from a SparseOperator it is the same repaired matrix: rows, columns, sums and gathers are equal bits, as what
/// it adds are zeros, which change no sum of finite numbers. Cost: 8 n^2 bytes; O(n) a row or column.
class DenseOperator final : public TransportOperator {
 public:
  explicit DenseOperator(const SparseOperator& sparse);

  /// A matrix as it is, without any repair; it need not be reciprocal. Shapes: form_factors [n][n], areas [n].
  /// Errors: invalid_argument, with row and column, where it is not square, or where a form factor is negative or not
  /// finite, or an area not positive and finite. Row sums above 1 are left to the solvers, which end as diverged.
  static Result<DenseOperator> from_matrix(const std::vector<std::vector<double>>& form_factors,
                                           std::vector<double> areas);

  void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  void column(std::uint32_t j, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override;
  Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const override { return gathered(i, radiosity); }
  double gather_at(std::uint32_t i, std::span<const double> radiosity) const override { return gathered(i, radiosity); }
  double row_sum(std::uint32_t i) const override;
  bool is_reciprocal() const override { return is_reciprocal_; }
  std::size_t row_length(std::uint32_t i) const override { return row_lengths_[i]; }
  std::span<const double> areas() const override { return areas_; }

 private:
  DenseOperator() = default;
  template <Channels C>
  C gathered(std::uint32_t i, std::span<const C> radiosity) const;
  const double* exchange_row(std::uint32_t i) const { return exchange_.data() + i * areas_.size(); }

  // F_ij = d_i S_ij d_j / divisor_i: of a given matrix, S is F, and d and divisor are 1.
  std::vector<double> exchange_;            ///< S, row by row
  std::vector<double> scale_;               ///< d
  std::vector<double> divisors_;            ///< areas, or 1
  std::vector<std::uint32_t> row_lengths_;  ///< entries that are not zero by structure
  std::vector<double> areas_;
  bool is_reciprocal_ = true;
  bool is_symmetric_ = false;  ///< S is: a column can be read along a row
};

}  // namespace radbake::radiosity
