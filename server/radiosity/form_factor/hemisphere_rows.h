#pragma once

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/form_factor/row_estimator.h"

namespace radbake::radiosity {

/// Rows of patches by cosine-distributed rays: weight_ij is the number of rays that meet j first.
/// A site is buried where most of its rays meet backs; its rays do not count.
class HemisphereRows final : public RowEstimator {
 public:
  HemisphereRows(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility, int rays)
      : rays_(surfaces, patches, visibility, rays) {}

  const char* name() const override { return "hemisphere"; }
  std::unique_ptr<RowScratch> make_scratch() const override;
  int num_sites() const override { return rays_.num_sites(); }
  void estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                const std::stop_token& stop, FormFactorRow& row, std::vector<std::uint8_t>& is_buried) const override;

 private:
  HemisphereEstimator rays_;
};

}  // namespace radbake::radiosity
