#include "server/radiosity/gather/parting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace radbake::radiosity {
namespace {

class Parting {
 public:
  Parting(const Surfaces& surfaces, const Visibility& visibility, std::span<const Site> sites, PartingScratch& scratch)
      : surfaces_(surfaces), visibility_(visibility), sites_(sites), scratch_(scratch) {}

  /// The part that begins with a site: all that it sees, then what the nearest of those see, and so on, around corners.
  void grow(std::uint32_t first, std::uint32_t part) {
    constexpr int kSteps = 8;
    scratch_.part[first] = part;
    bool is_changed = take_seen(part, [first](std::uint32_t) { return first; });
    for (int step = 1; step < kSteps && is_changed; ++step) {
      is_changed = take_seen(part, [&](std::uint32_t s) { return nearest_of(part, s); });
    }
  }

 private:
  std::uint32_t nearest_of(std::uint32_t part, std::uint32_t s) const {
    std::uint32_t nearest = s;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t k = 0; k < sites_.size(); ++k) {
      if (scratch_.part[k] != part) continue;
      const Vec3 between = sites_[k].position - sites_[s].position;
      if (dot(between, between) >= least) continue;
      least = dot(between, between);
      nearest = k;
    }
    return nearest;
  }

  /// Takes those into a part that see the one of it which `seen_from` tells. Returns whether it grew and some are left.
  template <typename SeenFrom>
  bool take_seen(std::uint32_t part, const SeenFrom& seen_from) {
    scratch_.segments.clear();
    scratch_.targets.clear();
    std::size_t num_taken = 0;
    for (std::uint32_t s = 0; s < sites_.size(); ++s) {
      if (scratch_.part[s] != kNoPart) continue;
      const Site& from = sites_[seen_from(s)];
      if (are_coplanar(from, sites_[s])) {
        scratch_.segments.push_back(segment_between(surfaces_, from, sites_[s]));
        scratch_.targets.push_back(s);
      } else {
        scratch_.part[s] = part;
        ++num_taken;
      }
    }
    scratch_.is_blocked.resize(scratch_.targets.size());
    visibility_.blocked(scratch_.segments, scratch_.is_blocked);
    std::size_t num_left = 0;
    for (std::size_t k = 0; k < scratch_.targets.size(); ++k) {
      if (scratch_.is_blocked[k]) {
        ++num_left;
      } else {
        scratch_.part[scratch_.targets[k]] = part;
        ++num_taken;
      }
    }
    return num_taken > 0 && num_left > 0;
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

void assign_parts(const Surfaces& surfaces, const Visibility& visibility, std::span<const Site> places,
                  std::span<const std::uint32_t> part_of, std::span<const Site> sites, PartingScratch& scratch) {
  constexpr std::size_t kTries = 4;
  scratch.part.assign(sites.size(), kNoPart);
  // The nearest places of each site, nearest first.
  std::vector<std::array<std::uint32_t, kTries>> nearest(sites.size());
  std::vector<std::pair<double, std::uint32_t>> order(places.size());
  for (std::size_t s = 0; s < sites.size(); ++s) {
    for (std::uint32_t k = 0; k < places.size(); ++k) {
      const Vec3 between = places[k].position - sites[s].position;
      order[k] = {dot(between, between), k};
    }
    const std::size_t num = std::min(kTries, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(num), order.end());
    for (std::size_t t = 0; t < kTries; ++t) nearest[s][t] = order[std::min(t, num - 1)].second;
  }
  for (std::size_t t = 0; t < kTries; ++t) {
    scratch.segments.clear();
    scratch.targets.clear();
    for (std::uint32_t s = 0; s < sites.size(); ++s) {
      if (scratch.part[s] != kNoPart) continue;
      const Site& place = places[nearest[s][t]];
      if (!are_coplanar(sites[s], place)) {
        scratch.part[s] = part_of[nearest[s][t]];
        continue;
      }
      scratch.segments.push_back(segment_between(surfaces, sites[s], place));
      scratch.targets.push_back(s);
    }
    if (scratch.targets.empty()) return;
    scratch.is_blocked.resize(scratch.targets.size());
    visibility.blocked(scratch.segments, scratch.is_blocked);
    for (std::size_t k = 0; k < scratch.targets.size(); ++k) {
      if (!scratch.is_blocked[k]) scratch.part[scratch.targets[k]] = part_of[nearest[scratch.targets[k]][t]];
    }
  }
}

}  // namespace radbake::radiosity
