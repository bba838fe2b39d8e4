#include "server/radiosity/transport/dense_operator.h"

#include <cmath>
#include <string>

#include "server/radiosity/transport/sparse_operator.h"

namespace radbake::radiosity {

DenseOperator::DenseOperator(const SparseOperator& sparse)
    : exchange_(sparse.size() * sparse.size(), 0),
      scale_(sparse.scaling().begin(), sparse.scaling().end()),
      divisors_(sparse.divisors().begin(), sparse.divisors().end()),
      areas_(sparse.areas().begin(), sparse.areas().end()),
      is_reciprocal_(sparse.is_reciprocal()),
      is_symmetric_(true) {
  for (std::uint32_t i = 0; i < areas_.size(); ++i) {
    const SparseOperator::ExchangeRow entries = sparse.exchange_row(i);
    for (std::size_t k = 0; k < entries.patches.size(); ++k) {
      exchange_[i * size() + entries.patches[k]] = entries.exchange[k];
    }
    row_lengths_.push_back(static_cast<std::uint32_t>(entries.patches.size()));
  }
}

Result<DenseOperator> DenseOperator::from_matrix(const std::vector<std::vector<double>>& form_factors,
                                                 std::vector<double> areas) {
  const std::size_t n = areas.size();
  if (form_factors.size() != n) {
    return invalid_argument("the form factors have " + std::to_string(form_factors.size()) + " rows for " +
                            std::to_string(n) + " areas");
  }
  DenseOperator dense;
  for (std::size_t i = 0; i < n; ++i) {
    const std::string name = "form factor row " + std::to_string(i);
    if (!(std::isfinite(areas[i]) && areas[i] > 0)) {
      return invalid_argument("area " + std::to_string(i) + " is " + std::to_string(areas[i]) + ", not above 0");
    }
    if (form_factors[i].size() != n) {
      return invalid_argument(name + " has " + std::to_string(form_factors[i].size()) + " entries, not " +
                              std::to_string(n));
    }
    std::uint32_t length = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const double f = form_factors[i][j];
      if (!(std::isfinite(f) && f >= 0)) {
        return invalid_argument(name + ", column " + std::to_string(j) + ", is " + std::to_string(f) +
                                ", not a share of light");
      }
      length += f != 0;
      dense.exchange_.push_back(f);
    }
    dense.row_lengths_.push_back(length);
  }
  dense.scale_.assign(n, 1);
  dense.divisors_.assign(n, 1);
  dense.areas_ = std::move(areas);
  return dense;
}

// Every product is in SparseOperator's order, for equal bits.

void DenseOperator::row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const {
  patches.clear();
  form_factors.clear();
  const double* exchange = exchange_row(i);
  for (std::uint32_t j = 0; j < areas_.size(); ++j) {
    if (exchange[j] == 0) continue;
    patches.push_back(j);
    form_factors.push_back(divisors_[i] > 0 ? scale_[i] * scale_[j] * exchange[j] / divisors_[i] : 0);
  }
}

void DenseOperator::column(std::uint32_t j, std::vector<std::uint32_t>& patches,
                           std::vector<double>& form_factors) const {
  patches.clear();
  form_factors.clear();
  const double* along_row = exchange_row(j);
  for (std::uint32_t i = 0; i < areas_.size(); ++i) {
    const double exchange = is_symmetric_ ? along_row[i] : exchange_row(i)[j];
    if (exchange == 0) continue;
    patches.push_back(i);
    form_factors.push_back(divisors_[i] > 0 ? scale_[i] * scale_[j] * exchange / divisors_[i] : 0);
  }
}

template <Channels C>
C DenseOperator::gathered(std::uint32_t i, std::span<const C> radiosity) const {
  C sum{};
  const double* exchange = exchange_row(i);
  for (std::size_t j = 0; j < areas_.size(); ++j) sum += radiosity[j] * (exchange[j] * scale_[j]);
  return divisors_[i] > 0 ? sum * (scale_[i] / divisors_[i]) : C{};
}
template double DenseOperator::gathered(std::uint32_t, std::span<const double>) const;
template Vec3 DenseOperator::gathered(std::uint32_t, std::span<const Vec3>) const;

double DenseOperator::row_sum(std::uint32_t i) const {
  double sum = 0;
  const double* exchange = exchange_row(i);
  for (std::size_t j = 0; j < areas_.size(); ++j) sum += exchange[j] * scale_[j];
  return divisors_[i] > 0 ? sum * scale_[i] / divisors_[i] : 0;
}

}  // namespace radbake::radiosity
