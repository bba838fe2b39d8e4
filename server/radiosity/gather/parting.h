#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Whether two sites lie in one plane, as far as a segment between them tells whether something stands there.
bool are_coplanar(const Site& a, const Site& b);

/// From one site to another, just above the surface.
Ray segment_between(const Surfaces& surfaces, const Site& a, const Site& b);

/// Buffers that one thread reuses from receiver to receiver.
struct PartingScratch {
  std::vector<std::uint32_t> part;  ///< [sites] which part a site belongs to
  std::vector<Ray> segments;
  std::vector<std::uint8_t> is_blocked;
  std::vector<std::uint32_t> targets;
};

/// Parts sites of one receiver by what stands between them, seen just above the surface, and numbers the parts in
/// scratch.part. A site that cannot be seen from the first of a part is tried from a few others of it; one that is not
/// in a plane with those belongs to them. Returns how many sites each part has.
std::vector<std::uint32_t> find_parts(const Surfaces& surfaces, const Visibility& visibility,
                                      std::span<const Site> sites, PartingScratch& scratch);

}  // namespace radbake::radiosity
