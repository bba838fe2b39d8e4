#include "server/radiosity/lights/emitter_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace radbake::radiosity {
namespace {

/// Least cosines, as in weigh_emitters().
constexpr float kLeastCosine = 0.05f, kLeastCosineOfSeveral = 0.3f;
/// Nodes narrower than this beside their distance, whose normals keep within this cone, are as one to a receiver.
constexpr float kNarrow = 0.2f, kNarrowCosine = 0.87f;
/// Beyond this depth nodes are halved by number: no tree gets much deeper.
constexpr int kMostUneven = 32;

Vec3 middle_of(const Emitter& emitter) {
  const double share = emitter.is_rectangle() ? 0.5 : 1.0 / 3;
  return emitter.corner + (emitter.s + emitter.t) * share;
}

/// Half the longest way across.
double radius_of(const Emitter& emitter) {
  const Vec3 middle = middle_of(emitter);
  double radius = std::max({length(emitter.corner - middle), length(emitter.corner + emitter.s - middle),
                            length(emitter.corner + emitter.t - middle)});
  return radius;
}

/// Cosine of the larger of 0 and a - b, for angles up to pi by their sines and cosines.
float cosine_of_difference(float sine_a, float cosine_a, float sine_b, float cosine_b) {
  return cosine_a > cosine_b ? 1.0f : cosine_a * cosine_b + sine_a * sine_b;
}
float sine_of_difference(float sine_a, float cosine_a, float sine_b, float cosine_b) {
  return cosine_a > cosine_b ? 0.0f : sine_a * cosine_b - cosine_a * sine_b;
}
float sine_of(float cosine) { return std::sqrt(std::max(0.0f, 1 - cosine * cosine)); }

}  // namespace

EmitterTree::EmitterTree(std::span<const Emitter> emitters) : order_(emitters.size()) {
  if (emitters.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  for (const Emitter& emitter : emitters) total_power_ += emitter.power;
  build(emitters, 0, static_cast<std::int32_t>(emitters.size()), 0);
  cumulative_power_.push_back(0);
  for (const std::int32_t e : order_) {
    cumulative_power_.push_back(cumulative_power_.back() + emitters[static_cast<std::size_t>(e)].power);
  }
}

std::int32_t EmitterTree::build(std::span<const Emitter> emitters, std::int32_t first, std::int32_t last, int depth) {
  const auto at = static_cast<std::int32_t>(nodes_.size());
  nodes_.emplace_back();
  bound(emitters, first, last, nodes_.back());
  if (last - first == 1) return at;

  // Halve the longest side of the middles' box; by number where that leaves one half empty.
  const auto middle = [&](std::int32_t e) { return middle_of(emitters[static_cast<std::size_t>(e)]); };
  Vec3 low = middle(order_[static_cast<std::size_t>(first)]), high = low;
  for (std::int32_t k = first; k < last; ++k) {
    const Vec3 m = middle(order_[static_cast<std::size_t>(k)]);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], m[axis]);
      high[axis] = std::max(high[axis], m[axis]);
    }
  }
  const Vec3 side = high - low;
  const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
  const double half = (low[axis] + high[axis]) / 2;
  const auto begin = order_.begin() + first, end = order_.begin() + last;
  auto split = std::stable_partition(begin, end, [&](std::int32_t e) { return middle(e)[axis] < half; });
  if (depth > kMostUneven || split == begin || split == end) split = begin + (last - first) / 2;
  const auto cut = static_cast<std::int32_t>(split - order_.begin());
  build(emitters, first, cut, depth + 1);
  const std::int32_t right = build(emitters, cut, last, depth + 1);
  nodes_[static_cast<std::size_t>(at)].right = right;
  return at;
}

void EmitterTree::bound(std::span<const Emitter> emitters, std::int32_t first, std::int32_t last, Node& node) const {
  const auto emitter = [&](std::int32_t k) -> const Emitter& {
    return emitters[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])];
  };
  // The sphere about the mean of the middles; the cone about the sum of the normals.
  Vec3 centre, axis;
  double power = 0;
  for (std::int32_t k = first; k < last; ++k) {
    centre += middle_of(emitter(k)) / (last - first);
    axis += emitter(k).normal * emitter(k).area;
    power += emitter(k).power;
    node.is_two_sided = node.is_two_sided || emitter(k).is_two_sided;
  }
  const double size = length(axis);
  axis = size > 0 ? axis / size : emitter(first).normal;
  double radius = 0, cosine = 1;
  for (std::int32_t k = first; k < last; ++k) {
    radius = std::max(radius, length(middle_of(emitter(k)) - centre) + radius_of(emitter(k)));
    cosine = std::min(cosine, dot(axis, emitter(k).normal));
  }
  // Wider by what single precision takes off.
  constexpr double kRounding = 1e-5;
  for (int c = 0; c < 3; ++c) {
    node.centre[static_cast<std::size_t>(c)] = static_cast<float>(centre[c]);
    node.axis[static_cast<std::size_t>(c)] = static_cast<float>(axis[c]);
  }
  node.radius = static_cast<float>(radius * (1 + kRounding) + 1e-7);
  node.cosine = static_cast<float>(std::max(-1.0, cosine - kRounding));
  node.sine = sine_of(node.cosine);
  node.power = static_cast<float>(power / total_power_);
  node.first = first;
  node.last = last;
}

EmitterTree::Seen EmitterTree::see(const Node& node, const ReceiverColumns& receiver) const {
  const std::array<float, 3> d = {node.centre[0] - static_cast<float>(receiver.middle.x),
                                  node.centre[1] - static_cast<float>(receiver.middle.y),
                                  node.centre[2] - static_cast<float>(receiver.middle.z)};
  const float radius = node.radius + receiver.radius;
  const float squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  const float distance = std::sqrt(squared);
  if (distance <= radius) return {node.power / (radius * radius), 1};

  // The angle of the sphere, and those of its middle to both normals.
  const float per_distance = 1 / distance, width = radius * per_distance, cosine = std::sqrt(1 - width * width);
  const auto along = [&](const Vec3& v) {
    return (d[0] * static_cast<float>(v.x) + d[1] * static_cast<float>(v.y) + d[2] * static_cast<float>(v.z)) *
           per_distance;
  };
  // The lobe about an interpolated normal ends at the surface or at its own horizon, whichever comes first.
  const float towards = along(receiver.normal);
  float receiving = cosine_of_difference(sine_of(towards), towards, width, cosine);
  if (receiver.is_flat && receiving <= 0) return {0, width};
  receiving = std::max(receiving, receiver.is_flat ? kLeastCosine : kLeastCosineOfSeveral);

  float back = -(d[0] * node.axis[0] + d[1] * node.axis[1] + d[2] * node.axis[2]) * per_distance;
  if (node.is_two_sided) back = std::fabs(back);
  const float back_sine = sine_of(back);
  const float of_cone = cosine_of_difference(back_sine, back, node.sine, node.cosine);
  const float of_cone_sine = sine_of_difference(back_sine, back, node.sine, node.cosine);
  const float sending = cosine_of_difference(of_cone_sine, of_cone, width, cosine);
  if (sending <= 0) return {0, width};
  return {node.power * receiving * std::max(sending, kLeastCosine) / squared, width};
}

bool EmitterTree::is_settled(const Node& node, float width) const {
  return node.right == 0 || (width < kNarrow && node.cosine > kNarrowCosine);
}

void EmitterTree::cut(const ReceiverColumns& receiver, std::size_t most, Cut& cut) const {
  cut.parts.clear();
  cut.cumulative.clear();
  const auto less = [](const Cut::Part& a, const Cut::Part& b) { return a.priority < b.priority; };
  const auto add = [&](std::int32_t node) {
    const Seen seen = see(nodes_[static_cast<std::size_t>(node)], receiver);
    if (!(seen.importance > 0)) return;
    const bool is_leaf = nodes_[static_cast<std::size_t>(node)].right == 0;
    const bool is_narrow = is_leaf || seen.width < kNarrow;
    cut.parts.push_back({node, seen.importance, seen.width, is_narrow ? 0 : seen.importance * seen.width});
    std::push_heap(cut.parts.begin(), cut.parts.end(), less);
  };
  add(0);
  while (!cut.parts.empty() && cut.parts.size() < most && cut.parts.front().priority > 0) {
    const std::int32_t node = cut.parts.front().node;
    std::pop_heap(cut.parts.begin(), cut.parts.end(), less);
    cut.parts.pop_back();
    add(node + 1);
    add(nodes_[static_cast<std::size_t>(node)].right);
  }
  // In the tree's order: neighbours in the sum are neighbours in space.
  std::sort(cut.parts.begin(), cut.parts.end(), [](const Cut::Part& a, const Cut::Part& b) { return a.node < b.node; });
  double sum = 0;
  for (const Cut::Part& part : cut.parts) cut.cumulative.push_back(sum += static_cast<double>(part.importance));
}

EmitterTree::Choice EmitterTree::choose(const ReceiverColumns& receiver, const Cut& cut, double u) const {
  const double total = cut.cumulative.back(), wanted = u * total;
  const auto part = std::min<std::size_t>(
      static_cast<std::size_t>(std::upper_bound(cut.cumulative.begin(), cut.cumulative.end(), wanted) -
                               cut.cumulative.begin()),
      cut.parts.size() - 1);
  const double before = part > 0 ? cut.cumulative[part - 1] : 0, share = cut.cumulative[part] - before;
  double probability = share / total;
  double rest = std::clamp((wanted - before) / share, 0.0, 1.0);

  // Go down while the node is wide.
  std::int32_t at = cut.parts[part].node;
  float width = cut.parts[part].width;
  for (;;) {
    const Node& node = nodes_[static_cast<std::size_t>(at)];
    if (is_settled(node, width)) break;
    const Seen left = see(nodes_[static_cast<std::size_t>(at + 1)], receiver);
    const Seen right = see(nodes_[static_cast<std::size_t>(node.right)], receiver);
    if (!(left.importance + right.importance > 0)) return {};
    const double of_left = static_cast<double>(left.importance / (left.importance + right.importance));
    if (rest < of_left) {
      rest /= of_left;
      probability *= of_left;
      at = at + 1;
      width = left.width;
    } else {
      rest = (rest - of_left) / (1 - of_left);
      probability *= 1 - of_left;
      at = node.right;
      width = right.width;
    }
  }

  // Take one of its emitters by power.
  const Node& node = nodes_[static_cast<std::size_t>(at)];
  const auto first = cumulative_power_.begin() + node.first, last = cumulative_power_.begin() + node.last;
  const double of_node = *last - *first;
  auto chosen = std::upper_bound(first + 1, last, *first + rest * of_node) - 1;
  const double power = *(chosen + 1) - *chosen;
  if (!(power > 0)) return {};
  return {order_[static_cast<std::size_t>(chosen - cumulative_power_.begin())], probability * power / of_node};
}

}  // namespace radbake::radiosity
