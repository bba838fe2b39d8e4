#include "server/radiosity/form_factor/hemisphere_rows.h"

#include <algorithm>

namespace radbake::radiosity {
namespace {

class Scratch final : public RowScratch {
 public:
  HemisphereEstimator::Scratch rays;
  RowSample sample;
};

/// Sorts the arrivals and counts equal ones.
void count_arrivals(std::vector<std::uint32_t>& arrivals, std::vector<FormFactorRow::Entry>& entries) {
  std::sort(arrivals.begin(), arrivals.end());
  entries.clear();
  for (const std::uint32_t patch : arrivals) {
    if (entries.empty() || entries.back().patch != patch) entries.push_back({patch, 0});
    ++entries.back().weight;
  }
}

}  // namespace

std::unique_ptr<RowScratch> HemisphereRows::make_scratch() const { return std::make_unique<Scratch>(); }

void HemisphereRows::estimate(std::uint32_t, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                              const std::stop_token&, FormFactorRow& row, std::vector<std::uint8_t>& is_buried) const {
  auto& [rays, sample] = static_cast<Scratch&>(scratch);
  rays_.sample_row(sites, seed, rays, sample);
  count_arrivals(sample.arrivals, row.entries);
  row.counted = sample.counted;
  row.escaped = sample.escaped;
  row.absorbed = sample.absorbed;
  row.traced = sample.traced;
  row.clipped = row.stated_error = 0;
  is_buried = sample.is_buried;
}

}  // namespace radbake::radiosity
