#include "server/radiosity/form_factor/analytic_occluders.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

namespace radbake::radiosity {
namespace {

// Of a group: its pieces times its corners. Larger ones are not asked whether they are convex.
constexpr std::size_t kMostConvexityTests = 4'000'000;

/// An edge, whichever way it is walked.
using Key = std::tuple<double, double, double, double, double, double>;
Key key_of(Vec3 a, Vec3 b) {
  const Key there{a.x, a.y, a.z, b.x, b.y, b.z}, back{b.x, b.y, b.z, a.x, a.y, a.z};
  return std::min(there, back);
}

/// Turns the pieces of a group outwards. Returns false if for some piece corners lie on both sides of its plane.
bool turn_outwards(std::vector<Piece>& pieces, const std::vector<std::uint32_t>& group) {
  std::size_t num_corners = 0;
  for (const std::uint32_t k : group) num_corners += pieces[k].corners.size();
  if (group.size() < 4 || group.size() * num_corners > kMostConvexityTests) return false;
  std::vector<std::uint32_t> inward;
  for (const std::uint32_t plane : group) {
    bool any_behind = false, any_in_front = false;
    for (const std::uint32_t k : group) {
      for (const Vec3& corner : pieces[k].corners) {
        const int side = pieces[plane].front.side(corner);
        any_behind = any_behind || side < 0;
        any_in_front = any_in_front || side > 0;
      }
      if (any_behind && any_in_front) return false;
    }
    if (!any_behind && !any_in_front) return false;
    if (any_in_front) inward.push_back(plane);
  }
  for (const std::uint32_t k : inward) {
    std::reverse(pieces[k].corners.begin(), pieces[k].corners.end());
    pieces[k].front = pieces[k].front.reversed();
  }
  return true;
}

}  // namespace

Occluders::Occluders(std::vector<Piece> pieces) : pieces_(std::move(pieces)), body_of_(pieces_.size(), kNoBody) {
  // Join pieces that share an edge; a group with an edge that is not shared by two is not closed.
  std::map<Key, std::vector<std::uint32_t>> users_of_edge;
  for (std::uint32_t k = 0; k < pieces_.size(); ++k) {
    const PolygonCorners& corners = pieces_[k].corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      users_of_edge[key_of(corners[i], corners[(i + 1) % corners.size()])].push_back(k);
    }
  }
  std::vector<std::uint32_t> parent(pieces_.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root_of = [&](std::uint32_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  std::vector<std::uint8_t> has_free_edge(pieces_.size(), 0);
  for (const auto& [edge, users] : users_of_edge) {
    for (const std::uint32_t k : users) {
      has_free_edge[k] = has_free_edge[k] | (users.size() != 2);
      parent[root_of(k)] = root_of(users[0]);
    }
  }
  std::map<std::uint32_t, std::vector<std::uint32_t>> groups;
  for (std::uint32_t k = 0; k < pieces_.size(); ++k) groups[root_of(k)].push_back(k);
  for (const auto& [root, group] : groups) {
    const bool is_open =
        std::any_of(group.begin(), group.end(), [&](std::uint32_t k) { return has_free_edge[k] != 0; });
    if (is_open || !turn_outwards(pieces_, group)) continue;
    for (const std::uint32_t k : group) body_of_[k] = static_cast<std::uint32_t>(bodies_.size());
    bodies_.push_back(group);
  }
}

Place place_of(const Piece& patch, const Occluders& occluders, std::uint32_t body) {
  bool is_inside = true;
  PolygonCorners rest = patch.corners, clipped;
  for (const std::uint32_t k : occluders.faces(body)) {
    const HalfSpace& outside = occluders.pieces()[k].front;
    int least = 1, most = -1;
    for (const Vec3& corner : patch.corners) {
      const int side = outside.side(corner);
      least = std::min(least, side), most = std::max(most, side);
    }
    const bool lies_on_it = least == 0 && most == 0;
    if (least >= 0 && (!lies_on_it || dot(patch.front.normal, outside.normal) > 0)) return Place::kOutside;
    if (lies_on_it) continue;
    is_inside = is_inside && most <= 0;
    if (rest.empty()) continue;
    clip_convex(rest, outside.reversed(), clipped);
    rest.swap(clipped);
  }
  return is_inside ? Place::kInside : rest.empty() ? Place::kOutside : Place::kAcross;
}

}  // namespace radbake::radiosity
