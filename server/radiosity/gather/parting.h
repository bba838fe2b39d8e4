#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

inline constexpr std::uint32_t kNoPart = std::numeric_limits<std::uint32_t>::max();

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
/// scratch.part. A site that cannot be seen from the first of a part is tried from the nearest of it, as it grows; one
/// that is not in a plane with that belongs to it. Returns how many sites each part has.
std::vector<std::uint32_t> find_parts(const Surfaces& surfaces, const Visibility& visibility,
                                      std::span<const Site> sites, PartingScratch& scratch);

/// Which of the parts of `places` other sites of the same receiver belong to: that of the nearest place that a site
/// sees, of the nearest few; kNoPart where it sees none. Shapes: part_of [places]; scratch.part [sites], out.
void assign_parts(const Surfaces& surfaces, const Visibility& visibility, std::span<const Site> places,
                  std::span<const std::uint32_t> part_of, std::span<const Site> sites, PartingScratch& scratch);

}  // namespace radbake::radiosity
