#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "server/radiosity/gather/light_estimate.h"
#include "server/radiosity/gather/receive.h"
#include "server/radiosity/gather/texel_roles.h"
#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/lightmap/fill.h"

namespace radbake::radiosity {

/// A rectangle of finished texels of one sheet. Shapes: rgba [height * width * 4], rows from the top.
struct GatheredTile {
  int sheet = 0;
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<float> rgba;
  std::uint64_t texels_done = 0;  ///< with coverage, so far in the whole pass
};

/// What a texel is to its lightmap.
struct TexelFacts {
  TexelState state = TexelState::kOutside;
  bool is_emitter = false;
  Receiver::Parts parts = Receiver::Parts::kUnknown, parts_behind = Receiver::Parts::kUnknown;
  float coverage = 0;
  float area = 0;  ///< of its footprint, scene units squared

  /// Whether what it is off by counts.
  bool counts() const { return state == TexelState::kValid && !is_emitter; }
};

/// One pass of the final gather.
struct GatherPass {
  /// For texels that gather alone, and for nodes: the same but for the rays of their rows.
  const GatherScene& alone;
  const GatherScene& nodes;
  int light_samples = 0;  ///< shadow rays to emitters of all replicates, a texel
  std::span<const std::uint8_t> light_levels =
      {};             ///< [texels] log2 of the own samples of each replicate; empty: all alike
  double weight = 1;  ///< of this pass's gathered light
};

/// What a pass took.
struct GatherCounts {
  std::uint64_t num_rays = 0, num_light_rays = 0;
  std::uint64_t num_gathered = 0;                ///< texels that gathered by themselves
  std::array<double, kMaxReplicates> squares{};  ///< of each replicate's distance from their mean, summed over texels

  GatherCounts& operator+=(const GatherCounts& other);
};

/// Lightmaps in the making, sheets stacked.
class LightmapGather {
 public:
  /// keeps_parts: what surfaces reflect; keeps_openness: ambient occlusion.
  LightmapGather(const Surfaces& surfaces, const Atlas& atlas, const Visibility& shadows, int spacing, bool keeps_parts,
                 bool keeps_openness);

  /// Final gather of one pass: receive() over the footprint of each texel, or, of plain squares, over the footprints of
  /// their nodes and direct light everywhere. A buried texel is invalid. Tiles are reported as they finish, one call at
  /// a time, in any order; the map does not depend on that order. Stopped, the estimate means nothing. Once `is_over`,
  /// asked from any thread, says so, what was not begun keeps what earlier passes found: false then, and no other pass
  /// may follow.
  bool add_pass(const GatherPass& pass, const std::function<void(const GatheredTile&)>& on_tile, std::stop_token stop,
                const std::function<bool()>& is_over, GatherCounts& counts);

  /// What passes so far gathered from patches does not count any more; direct light does.
  void forget_gathered() {
    estimate_.forget_gathered();
    spread_.forget();
  }

  /// Squares of texels whose light is further off than a limit because it is interpolated.
  struct Interpolation {
    double squares = 0;            ///< of what their texels that count are off by, summed, mean of the channels, lx^2
    std::uint64_t num_texels = 0;  ///< that count
  };
  /// limit: root mean square over a square and those beside it, lx.
  Interpolation interpolation_above(double limit) const;
  /// Texels of such squares gather alone from the next pass on; what was interpolated there does not count any more.
  void stop_interpolating_above(double limit);

  const Atlas& atlas() const { return atlas_; }
  const LightEstimate& estimate() const { return estimate_; }
  const std::vector<TexelFacts>& facts() const { return facts_; }
  std::size_t cell_of(std::size_t texel) const {
    const std::size_t x = texel % static_cast<std::size_t>(atlas_.width()),
                      y = texel / static_cast<std::size_t>(atlas_.width());
    return y / LightEstimate::kCell * cells_across_ + x / LightEstimate::kCell;
  }
  std::size_t cells_across() const { return cells_across_; }
  /// Whether any texel of a cell is valid.
  bool has_light(std::size_t cell) const { return cell_has_light_[cell] != 0; }
  /// Of valid texels, weighted by area, mean of the channels, lx.
  double mean_irradiance() const;
  double relative_spread() const { return spread_.relative(); }

  /// Between passes.
  template <typename Archive>
  void keep(Archive& archive) {
    roles_.keep(archive);
    estimate_.keep(archive);
    archive.of_known_size(facts_);
    archive.of_known_size(cell_has_light_);
    spread_.keep(archive);
  }

 private:
  /// What the nodes of one pass found.
  struct NodeLight;
  struct Scratch;

  /// False where it ended early.
  bool gather_nodes(const GatherPass& pass, std::stop_token stop, const std::function<bool()>& is_over,
                    std::vector<NodeLight>& nodes, GatherCounts& counts);
  void judge_squares(const std::vector<NodeLight>& nodes);
  double interpolation_square(const std::vector<NodeLight>& nodes, int i, int j) const;
  /// The texel of a node, or one beside it.
  std::size_t texel_of_node(int i, int j, int dx = 0, int dy = 0) const {
    return static_cast<std::size_t>(j * roles_.spacing() + dy) * static_cast<std::size_t>(atlas_.width()) +
           static_cast<std::size_t>(i * roles_.spacing() + dx);
  }
  /// Calls back with (i, j) of each plain square that is off by more than the limit.
  template <typename OnSquare>
  void for_each_square_above(double limit, const OnSquare& on_square) const;
  /// (u, v) in the unit square.
  Site site_at(const Footprint& footprint, double u, double v) const;
  void place_sites(const GatherScene& scene, const SobolPoints& points, int x, int y, Scratch& scratch) const;
  /// Sites all over a texel, for direct light only. Precondition: it has a home, or scratch.footprint is its own.
  void place_light_sites(const GatherScene& scene, int x, int y, int num_sites, Scratch& scratch) const;
  /// The texel by itself: false where it covers nothing or is buried.
  bool gather_alone(const GatherPass& pass, const GatherScene& scene, const SobolPoints& points, int x, int y,
                    Scratch& scratch, NodeLight* node);
  void gather_between(const GatherPass& pass, const std::vector<NodeLight>& nodes, const TexelRoles::Between& between,
                      int x, int y, Scratch& scratch);
  int light_samples_of(const GatherPass& pass, std::size_t texel) const;

  const Surfaces& surfaces_;
  const Atlas& atlas_;
  std::size_t cells_across_;
  TexelRoles roles_;
  LightEstimate estimate_;
  std::vector<TexelFacts> facts_;             ///< [texels]
  std::vector<std::uint8_t> cell_has_light_;  ///< [cells]
  ReplicateSpread spread_;
};

}  // namespace radbake::radiosity
