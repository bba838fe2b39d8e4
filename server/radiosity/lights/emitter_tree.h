#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/lights/emitters.h"
#include "server/radiosity/lights/light_columns.h"

namespace radbake::radiosity {

/// A tree over many emitters, to choose one by what it is likely to bring to a receiver without looking at all.
///
///   importance of a node = P max(cos, k) max(cos', k) / max(d^2, R^2)
///
/// P: power; d, R: distance and radius of its bounding sphere; cos, cos': the largest cosines at the receiver and at
/// the emitters that any point of the sphere and any normal of the node's cone allow. 0 only where no light can arrive.
/// A receiver cuts the tree into nodes that are small beside their distance, up to a number; a sample chooses a node
/// of the cut by its importance, goes down by the children's importance where the node is still wide, else takes one of
/// its emitters by power.
/// Cost: O(cut) a receiver, O(log emitters) a sample. Source: Conty Estevez & Kulla 2018, "Importance sampling of many
/// lights with adaptive tree splitting"; Walter et al. 2005 (cuts).
class EmitterTree {
 public:
  explicit EmitterTree(std::span<const Emitter> emitters);

  struct Cut {
    struct Part {
      std::int32_t node;
      float importance;
      float width;
      float priority;  ///< of being cut further
    };
    std::vector<Part> parts;
    std::vector<double> cumulative;  ///< [parts] importance
  };
  /// Into at most `most` nodes.
  void cut(const ReceiverColumns& receiver, std::size_t most, Cut& cut) const;

  struct Choice {
    std::int32_t emitter = -1;  ///< none: nothing arrives from where the choice fell
    double probability = 0;
  };
  /// Chooses an emitter for a uniform u in [0, 1). Precondition: the cut has importance.
  Choice choose(const ReceiverColumns& receiver, const Cut& cut, double u) const;

 private:
  struct Node {
    std::array<float, 3> centre, axis;
    float radius = 0;
    float cosine = 1, sine = 0;        ///< of the half-angle of the cone that holds all normals
    float power = 0;                   ///< share of that of all
    std::int32_t first = 0, last = 0;  ///< emitters in the tree's order
    std::int32_t right = 0;            ///< second child; the first is the next node. 0: a leaf
    bool is_two_sided = false;
  };
  struct Seen {
    float importance;
    float width;  ///< radius over distance
  };

  std::int32_t build(std::span<const Emitter> emitters, std::int32_t first, std::int32_t last, int depth);
  void bound(std::span<const Emitter> emitters, std::int32_t first, std::int32_t last, Node& node) const;
  Seen see(const Node& node, const ReceiverColumns& receiver) const;
  bool is_settled(const Node& node, float width) const;

  std::vector<Node> nodes_;
  double total_power_ = 0;
  std::vector<std::int32_t> order_;       ///< emitters
  std::vector<double> cumulative_power_;  ///< [emitters + 1] of those before, in the tree's order
};

}  // namespace radbake::radiosity
