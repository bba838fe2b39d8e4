#include "server/radiosity/form_factor/patch_polygons.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

namespace radbake::radiosity {
namespace {

// The longest side of the surfaces' box is below 2, about 0: corners have the spacing of 1.
constexpr double kUlp = std::numeric_limits<double>::epsilon();
constexpr double kSameCorner = 0x1p-44;

/// Polygons by numbers of corners, and the joining of those that share an edge.
class Joiner {
 public:
  explicit Joiner(const std::vector<Piece>& pieces) : pieces_(pieces) {
    std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t>, std::uint32_t> numbers;
    for (const Piece& piece : pieces) {
      Outline outline;
      for (const Vec3& corner : piece.corners) {
        const auto rounded = [](double x) { return std::llround(x / kSameCorner); };
        const auto [entry, is_new] = numbers.try_emplace({rounded(corner.x), rounded(corner.y), rounded(corner.z)},
                                                         static_cast<std::uint32_t>(positions_.size()));
        if (is_new) positions_.push_back(corner);
        outline.push_back(entry->second);
      }
      outlines_.push_back(outline);
    }
    for (std::uint32_t k = 0; k < outlines_.size(); ++k) add_edges(k);
  }

  std::vector<Piece> join(std::vector<std::uint32_t>& came_from) {
    std::vector<std::uint32_t> joined_to(pieces_.size());
    std::vector<std::uint8_t> has_joined(pieces_.size(), 0);
    for (std::uint32_t k = 0; k < joined_to.size(); ++k) joined_to[k] = k;
    for (std::uint32_t k = 0; k < outlines_.size(); ++k) {
      // Take in neighbours as long as one fits.
      for (std::uint32_t other = neighbour_that_fits(k); other != kNone; other = neighbour_that_fits(k)) {
        remove_edges(k), remove_edges(other);
        outlines_[k] = union_;
        outlines_[other].clear();
        joined_to[other] = k;
        has_joined[k] = 1;
        add_edges(k);
      }
    }
    // Number what is left; follow who was joined to whom.
    std::vector<Piece> result;
    std::vector<std::uint32_t> number(pieces_.size(), kNone);
    for (std::uint32_t k = 0; k < outlines_.size(); ++k) {
      if (outlines_[k].empty()) continue;
      number[k] = static_cast<std::uint32_t>(result.size());
      Piece piece{{}, pieces_[k].front};
      if (!has_joined[k]) {
        piece.corners = pieces_[k].corners;
      } else {
        for (const std::uint32_t corner : outlines_[k]) piece.corners.push_back(positions_[corner]);
        if (auto front = plane_of(piece.corners, kUlp, "a patch"); front.ok()) piece.front = *front;
      }
      result.push_back(std::move(piece));
    }
    came_from.resize(pieces_.size());
    for (std::uint32_t k = 0; k < pieces_.size(); ++k) {
      std::uint32_t last = k;
      while (joined_to[last] != last) last = joined_to[last];
      came_from[k] = number[last];
    }
    return result;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  using Outline = std::vector<std::uint32_t>;

  void add_edges(std::uint32_t k) {
    const Outline& outline = outlines_[k];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      users_.emplace(std::pair(outline[i], outline[(i + 1) % outline.size()]), k);
    }
  }
  void remove_edges(std::uint32_t k) {
    const Outline& outline = outlines_[k];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const auto found = users_.find(std::pair(outline[i], outline[(i + 1) % outline.size()]));
      if (found != users_.end() && found->second == k) users_.erase(found);
    }
  }

  std::uint32_t neighbour_that_fits(std::uint32_t k) {
    const Outline& outline = outlines_[k];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const auto found = users_.find(std::pair(outline[(i + 1) % outline.size()], outline[i]));
      if (found == users_.end() || found->second == k || !fits(k, found->second, i)) continue;
      return found->second;
    }
    return kNone;
  }

  /// Whether two polygons lie in one plane and their union is convex: then it is in union_.
  bool fits(std::uint32_t k, std::uint32_t other, std::size_t edge) {
    const HalfSpace& plane = pieces_[k].front;
    const Outline &a = outlines_[k], &b = outlines_[other];
    if (dot(plane.normal, pieces_[other].front.normal) <= 0) return false;
    for (const std::uint32_t corner : b) {
      if (std::abs(plane.distance(positions_[corner])) > plane.near) return false;
    }
    // From the shared edge's end round the first, then round the second; what becomes straight is no corner.
    const std::uint32_t start = a[edge], end = a[(edge + 1) % a.size()];
    Outline round;
    for (std::size_t i = 0; i + 1 < a.size(); ++i) round.push_back(a[(edge + 1 + i) % a.size()]);
    const auto at_start = static_cast<std::size_t>(std::find(b.begin(), b.end(), start) - b.begin());
    for (std::size_t i = 0; i + 1 < b.size(); ++i) round.push_back(b[(at_start + i) % b.size()]);
    union_.clear();
    for (std::size_t i = 0; i < round.size(); ++i) {
      const Vec3 before = positions_[round[(i + round.size() - 1) % round.size()]], here = positions_[round[i]];
      const Vec3 in = here - before, out = positions_[round[(i + 1) % round.size()]] - here;
      const double turn = dot(cross(in, out), plane.normal), slack = plane.near * (length(in) + length(out));
      if (turn < -slack) return false;
      const bool is_straight = turn <= slack && dot(in, out) > 0;
      if (!is_straight || (round[i] != start && round[i] != end)) union_.push_back(round[i]);
    }
    return union_.size() >= 3;
  }

  const std::vector<Piece>& pieces_;
  std::vector<Vec3> positions_;
  std::vector<Outline> outlines_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> users_;
  Outline union_;
};

/// The triangles of the scene joined; occluder_of[t] is where triangle t went.
std::vector<Piece> joined_surfaces(const Surfaces& surfaces, std::vector<std::uint32_t>& occluder_of) {
  std::vector<Piece> triangles;
  std::vector<std::uint32_t> piece_of(surfaces.size(), kNoBody), came_from;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    PolygonCorners corners(surfaces.corners[t].begin(), surfaces.corners[t].end());
    auto front = plane_of(corners, kUlp, "a triangle");
    if (!front.ok()) continue;
    piece_of[t] = static_cast<std::uint32_t>(triangles.size());
    triangles.push_back({std::move(corners), *front});
  }
  std::vector<Piece> joined = joined_pieces(triangles, came_from);
  occluder_of.assign(surfaces.size(), kNoBody);
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    if (piece_of[t] != kNoBody) occluder_of[t] = came_from[piece_of[t]];
  }
  return joined;
}

}  // namespace

std::vector<Piece> joined_pieces(const std::vector<Piece>& pieces, std::vector<std::uint32_t>& came_from) {
  return Joiner(pieces).join(came_from);
}

PatchPolygons::PatchPolygons(const Surfaces& surfaces, const Patches& patches)
    : occluders_(joined_surfaces(surfaces, occluder_of_)) {
  first_.push_back(0);
  std::vector<std::uint32_t> came_from;
  for (std::uint32_t front = 0; front < patches.num_cells(); ++front) {
    std::vector<Piece> parts;
    for (const Patches::Piece& part : patches.pieces(front)) {
      PolygonCorners corners;
      for (const Vec2& uv : part.corners) corners.push_back(surfaces.position({part.triangle, uv.x, uv.y}));
      auto plane = plane_of(corners, kUlp, "a patch");
      if (plane.ok()) parts.push_back({std::move(corners), *plane});
    }
    for (Piece& piece : joined_pieces(parts, came_from)) pieces_.push_back(std::move(piece));
    first_.push_back(pieces_.size());
  }
  for (const Piece& piece : pieces_) {
    backs_.push_back({{piece.corners.rbegin(), piece.corners.rend()}, piece.front.reversed()});
  }
}

}  // namespace radbake::radiosity
