#include "server/radiosity/transport/streamed_operator.h"

#include <algorithm>

#include "common/base/check.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {

double StreamedOperator::estimate(std::uint32_t i, std::vector<EstimatedRows::Entry>& entries) const {
  source_(i, entries);
  double sum = 0;
  for (const EstimatedRows::Entry& entry : entries) sum += entry.weight;
  return sum > 0 ? sums_.measured[i] / sum : 0;
}

void StreamedOperator::row(std::uint32_t i, std::vector<std::uint32_t>& patches,
                           std::vector<double>& form_factors) const {
  std::vector<EstimatedRows::Entry> entries;
  const double scale = estimate(i, entries);
  patches.clear();
  form_factors.clear();
  for (const EstimatedRows::Entry& entry : entries) {
    patches.push_back(entry.patch);
    form_factors.push_back(entry.weight * scale);
  }
}

void StreamedOperator::column(std::uint32_t j, std::vector<std::uint32_t>& patches,
                              std::vector<double>& form_factors) const {
  row(j, patches, form_factors);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const double area = sums_.areas[patches[k]];
    form_factors[k] = area > 0 ? form_factors[k] * sums_.areas[j] / area : 0;
  }
}

template <Channels C>
C StreamedOperator::gathered(std::uint32_t i, std::span<const C> radiosity) const {
  RADBAKE_CHECK(!is_by_columns());
  std::vector<EstimatedRows::Entry> entries;
  const double scale = estimate(i, entries);
  C sum{};
  for (const EstimatedRows::Entry& entry : entries) sum += radiosity[entry.patch] * entry.weight;
  return sum * scale;
}
template double StreamedOperator::gathered(std::uint32_t, std::span<const double>) const;
template Vec3 StreamedOperator::gathered(std::uint32_t, std::span<const Vec3>) const;

template <Channels C>
void StreamedOperator::scatter_columns(std::span<const C> radiosity, std::span<C> irradiance) const {
  RADBAKE_CHECK_EQ(radiosity.size(), size());
  RADBAKE_CHECK_EQ(irradiance.size(), size());
  // Estimate a block of columns side by side, then add them up in order.
  constexpr std::size_t kColumnsPerBlock = 256;
  struct Column {
    std::vector<std::uint32_t> patches;
    std::vector<double> form_factors;
  };
  std::vector<Column> block(kColumnsPerBlock);
  std::fill(irradiance.begin(), irradiance.end(), C{});
  for (std::size_t first = 0; first < size(); first += kColumnsPerBlock) {
    const std::size_t count = std::min(kColumnsPerBlock, size() - first);
    for_each_range(count, rows_per_task(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        column(static_cast<std::uint32_t>(first + k), block[k].patches, block[k].form_factors);
      }
    });
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t at = 0; at < block[k].patches.size(); ++at) {
        irradiance[block[k].patches[at]] += radiosity[first + k] * block[k].form_factors[at];
      }
    }
  }
}

void StreamedOperator::gather(std::span<const Vec3> radiosity, std::span<Vec3> irradiance) const {
  if (!is_by_columns()) return TransportOperator::gather(radiosity, irradiance);
  scatter_columns(radiosity, irradiance);
}

void StreamedOperator::gather(std::span<const double> radiosity, std::span<double> irradiance) const {
  if (!is_by_columns()) return TransportOperator::gather(radiosity, irradiance);
  scatter_columns(radiosity, irradiance);
}

}  // namespace radbake::radiosity
