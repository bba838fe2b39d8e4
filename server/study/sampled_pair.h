#pragma once

#include <cstdint>

#include "common/base/sequence.h"
#include "server/radiosity/form_factor/hemicube.h"
#include "server/study/polygon_pair.h"

namespace radbake::study {

/// A form factor that was sampled.
struct SampledFormFactor {
  double form_factor = 0;
  double stated_error = 0;
  std::int64_t rays = 0;
};

inline constexpr int kMaxRaysOfReplicate = 1 << 20;
inline constexpr int kMaxSitesOfReplicate = 1 << 8;

/// Share of cosine-distributed rays from all over `from` that meet the front of `to` first: rays `first` to `end` of
/// one Owen-scrambled Sobol sequence over place and direction. Returns their number.
std::int64_t count_arrivals(const PolygonPair& pair, const SobolPoints& points, int first, int end, std::uint64_t seed);

/// What a hemicube at a site shows of `to`.
double hemicube_form_factor(const PolygonPair& pair, const radiosity::Hemicube& hemicube, Vec3 site, double turn);

/// Mean over hemicubes at `sites` places, each turned by chance.
double hemicube_form_factor(const PolygonPair& pair, const radiosity::Hemicube& hemicube, const SobolPoints& points,
                            int sites, std::uint64_t seed);

/// Form factor by rays: 16 replicates of 2^10, 2^12, ... 2^20 rays, until the stated error is within the tolerance.
///
///   stated = 5.24 s / 4 + ln(10^4) / rays
///
/// s: standard deviation of a replicate, 5.24: Student's factor of 15 degrees of freedom for a chance of 1e-4 to be
/// above; the last term: what no ray has met, or missed, with the same chance.
/// Shapes: points: as many as a replicate may have rays, kMaxRaysOfReplicate here.
/// Cost:   up to 17 million rays.
SampledFormFactor sampled_by_rays(const PolygonPair& pair, const SobolPoints& points, double tolerance);

/// Form factor by hemicubes: resolutions r = 8, 16, 32, 64 at r^2 places, in 16 replicates, until the stated error is
/// within the tolerance.
///
///   stated = |F_r - F_(r/2)| + 5.24 s / 4 + ln(10^4) / rays
///
/// The first term stands for the pixels' error, of first to second order in 1/r, which turning the cube does not
/// average away.
/// Shapes: points: as many as a replicate may have places, kMaxSitesOfReplicate here.
/// Cost:   up to 50 million rays.
SampledFormFactor sampled_by_hemicubes(const PolygonPair& pair, const SobolPoints& points, double tolerance);

}  // namespace radbake::study
