#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/vertex_groups.h"

namespace radbake::radiosity {

/// Light by vertex group, in the making.
class VertexGather {
 public:
  explicit VertexGather(const Surfaces& surfaces, const VertexGroups& groups);

  /// Final gather of one pass: receive() over the quarter of each incident triangle that lies next to the vertex.
  /// on_done is called from any thread with the number of groups done. Stopped, the estimate means nothing.
  void add_pass(const GatherScene& scene, int light_samples, double weight,
                const std::function<void(std::uint64_t)>& on_done, std::stop_token stop, GatherCounts& counts);

  /// As LightmapGather::forget_gathered().
  void forget_gathered() {
    estimate_.forget_gathered();
    spread_.forget();
  }

  /// Between passes.
  template <typename Archive>
  void keep(Archive& archive) {
    estimate_.keep(archive);
    for (auto* parts : {&parts_, &parts_behind_}) archive.of_known_size(*parts);
    archive.of_known_size(is_known_);
    spread_.keep(archive);
  }

  const LightEstimate& estimate() const { return estimate_; }
  double relative_spread() const { return spread_.relative(); }
  /// [groups] Whether a group is not buried.
  const std::vector<std::uint8_t>& is_known() const { return is_known_; }

 private:
  const Surfaces& surfaces_;
  const VertexGroups& groups_;
  LightEstimate estimate_;
  std::vector<Receiver::Parts> parts_, parts_behind_;  ///< [groups]
  std::vector<std::uint8_t> is_known_;
  ReplicateSpread spread_;
};

/// Light by vertex group. Shapes: irradiance [groups], lx.
struct GatheredVertices {
  std::vector<Vec3> irradiance;
  std::uint64_t num_filled = 0;  ///< buried groups that took their neighbours' mean, or 0 where they have none
  double mean_irradiance = 0;    ///< interpolated over the triangles, weighted by area, mean of the channels, lx
};

/// The light that the passes found, with buried groups filled.
GatheredVertices finish_vertices(const Surfaces& surfaces, const VertexGroups& groups, const VertexGather& gather);

}  // namespace radbake::radiosity
