#include "server/radiosity/gather/parting.h"

#include <cmath>
#include <limits>

namespace radbake::radiosity {
namespace {

constexpr std::uint32_t kNoPart = std::numeric_limits<std::uint32_t>::max();

class Parting {
 public:
  Parting(const Surfaces& surfaces, const Visibility& visibility, std::span<const Site> sites, PartingScratch& scratch)
      : surfaces_(surfaces), visibility_(visibility), sites_(sites), scratch_(scratch) {}

  /// The part that begins with a site.
  void grow(std::uint32_t first, std::uint32_t part) {
    constexpr int kTries = 4;
    scratch_.part[first] = part;
    std::uint32_t from = first;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const std::uint32_t found = reach(from, part);
      if (found == kNoPart) return;  // nobody is left
      from = found;
    }
  }

 private:
  /// Takes what is seen from a site into its part. Returns the last one taken, or `from`; kNoPart: all have a part.
  std::uint32_t reach(std::uint32_t from, std::uint32_t part) {
    scratch_.segments.clear();
    scratch_.targets.clear();
    std::uint32_t last = from;
    bool is_anybody_left = false;
    const Site& a = sites_[from];
    for (std::uint32_t s = 0; s < sites_.size(); ++s) {
      if (scratch_.part[s] != kNoPart) continue;
      const Site& b = sites_[s];
      if (!are_coplanar(a, b)) {
        scratch_.part[s] = part;
        continue;
      }
      scratch_.segments.push_back(segment_between(surfaces_, a, b));
      scratch_.targets.push_back(s);
    }
    scratch_.is_blocked.resize(scratch_.targets.size());
    visibility_.blocked(scratch_.segments, scratch_.is_blocked);
    for (std::size_t k = 0; k < scratch_.targets.size(); ++k) {
      if (scratch_.is_blocked[k]) {
        is_anybody_left = true;
      } else {
        scratch_.part[scratch_.targets[k]] = part;
        last = scratch_.targets[k];
      }
    }
    return is_anybody_left ? last : kNoPart;
  }

  const Surfaces& surfaces_;
  const Visibility& visibility_;
  std::span<const Site> sites_;
  PartingScratch& scratch_;
};

}  // namespace

bool are_coplanar(const Site& a, const Site& b) {
  constexpr double kFlat = 1e-3;
  const Vec3 between = b.position - a.position;
  const double limit = kFlat * length(between);
  return std::fabs(dot(between, a.facing)) <= limit && std::fabs(dot(between, b.facing)) <= limit &&
         dot(a.facing, b.facing) > 0;
}

Ray segment_between(const Surfaces& surfaces, const Site& a, const Site& b) {
  Ray segment;
  segment.origin = lifted_origin(surfaces, a.position, a.facing, a.point.triangle);
  const auto end = lifted_origin(surfaces, b.position, b.facing, b.point.triangle);
  for (int axis = 0; axis < 3; ++axis) segment.direction[axis] = end[axis] - segment.origin[axis];
  segment.max_distance = 1;
  return segment;
}

std::vector<std::uint32_t> find_parts(const Surfaces& surfaces, const Visibility& visibility,
                                      std::span<const Site> sites, PartingScratch& scratch) {
  scratch.part.assign(sites.size(), kNoPart);
  std::vector<std::uint32_t> sizes;
  Parting parting(surfaces, visibility, sites, scratch);
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    if (scratch.part[s] != kNoPart) continue;
    parting.grow(s, static_cast<std::uint32_t>(sizes.size()));
    sizes.push_back(0);
  }
  for (const std::uint32_t part : scratch.part) ++sizes[part];
  return sizes;
}

}  // namespace radbake::radiosity
