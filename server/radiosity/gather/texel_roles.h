#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Which texels gather the light along hemisphere rays by themselves, and which interpolate it.
///
/// Texels at every `spacing`-th column and row of a sheet are nodes. The square of texels between four nodes is *plain*
/// where one smooth surface covers all of it (the nodes' own texels included), nothing crosses it, and its four nodes
/// see light. In plain squares, gathered light is interpolated between the nodes; everywhere else, texels gather alone.
/// Source: the conditions of Ward, Rubinstein & Clear 1988, on the lightmap's own grid.
class TexelRoles {
 public:
  static constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

  /// spacing 1: all texels gather alone. `shadows`: what tells whether anything crosses a square.
  TexelRoles(const Surfaces& surfaces, const Atlas& atlas, const Visibility& shadows, int spacing);

  int spacing() const { return spacing_; }
  int nodes_across() const { return nodes_x_; }
  int nodes_down() const { return nodes_y_; }
  std::size_t num_nodes() const { return is_node_.size(); }
  /// Whether any plain square needs the node in column i, row j of nodes: texel (i spacing, j spacing).
  bool is_node(int i, int j) const { return is_node_[index_of(i, j)] != 0; }
  bool is_plain(int i, int j) const { return is_plain_[index_of(i, j)] != 0; }
  /// Calls back with (i, j) of each plain square, in order; it may refuse that one.
  template <typename OnSquare>
  void for_each_plain_square(const OnSquare& on_square) const {
    for (int j = 0; j + 1 < nodes_y_; ++j) {
      for (int i = 0; i + 1 < nodes_x_; ++i) {
        if (is_plain(i, j)) on_square(i, j);
      }
    }
  }
  /// The square right below and right of node (i, j) is not plain after all.
  void refuse(int i, int j) { is_plain_[index_of(i, j)] = 0; }

  /// Nodes and weights that a texel's light is interpolated from; empty where it gathers alone.
  struct Between {
    std::array<std::size_t, 4> nodes;
    std::array<double, 4> weights;
  };
  std::optional<Between> between(int x, int y) const;

  /// What passes have changed.
  template <typename Archive>
  void keep(Archive& archive) {
    archive.of_known_size(is_plain_);
  }

  /// The triangle that covers a texel wholly, or kNoTriangle.
  std::uint32_t home(int x, int y) const { return homes_[static_cast<std::size_t>(y) * width_ + x]; }
  /// A point of the texel's home, (dx, dy) within the texel. Precondition: it has one.
  SurfacePoint point_at_home(int x, int y, double dx, double dy) const;

 private:
  std::size_t index_of(int i, int j) const { return static_cast<std::size_t>(j) * nodes_x_ + i; }
  void find_homes();
  bool looks_plain(int i, int j, Footprint& footprint, std::vector<Ray>& segments,
                   std::vector<std::uint8_t>& is_blocked) const;
  /// Where a texel's middle lies, on the triangle that covers it or most likely does; empty: not wholly covered.
  std::optional<SurfacePoint> middle(int x, int y, Footprint& footprint) const;
  SurfacePoint point_on(std::uint32_t triangle, Vec2 at) const;

  const Surfaces& surfaces_;
  const Atlas& atlas_;
  const Visibility& shadows_;
  int spacing_, width_, height_, nodes_x_ = 0, nodes_y_ = 0;
  std::vector<std::uint32_t> homes_;              ///< [rows * width]
  std::vector<std::uint8_t> is_plain_, is_node_;  ///< [nodes]
};

}  // namespace radbake::radiosity
