#include "server/radiosity/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace radbake::radiosity {
namespace {

constexpr double kTexelsPerPatchEdge = 4;
constexpr double kMinPatches = 1024;

template <typename T>
Result<void> check_range(const char* name, T value, T low, T high) {
  if (value == T{} || (value >= low && value <= high)) return {};
  std::ostringstream out;
  out << name << " " << value << " is not within " << low << ".." << high;
  return invalid_argument(out.str());
}

}  // namespace

Result<void> check_options(const BakeOptions& options) {
  RADBAKE_RETURN_IF_ERROR(check_range("atlas size", options.atlas_size, kMinAtlasSize, kMaxAtlasSize));
  RADBAKE_RETURN_IF_ERROR(check_range("texels per metre", options.texels_per_meter, 1e-6, 1e9));
  RADBAKE_RETURN_IF_ERROR(check_range("rays", options.rays, kMinRays, kMaxRays));
  RADBAKE_RETURN_IF_ERROR(check_range("max patches", options.max_patches, kMinMaxPatches, 1 << 24));
  RADBAKE_RETURN_IF_ERROR(check_range("threads", options.threads, 1, 4096));
  return {};
}

double patch_edge(double texel_edge, double area, std::size_t max_patches) {
  const double coarsest = std::sqrt(area / kMinPatches);
  const double finest = std::sqrt(area / static_cast<double>(max_patches));
  return std::max(std::min(kTexelsPerPatchEdge * texel_edge, coarsest), finest);
}

}  // namespace radbake::radiosity
