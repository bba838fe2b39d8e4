#include "server/radiosity/gather/gather_vertices.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kSitesOfVertex = 21, kRaysOfVertex = 22, kLightOfVertex = 23 };

constexpr std::size_t kGroupsPerTask = 32;
/// How far along its edges a triangle counts for a vertex: half way, a quarter of its area.
constexpr double kReach = 0.5;

/// Buffers of one thread.
struct Scratch {
  ReceiveScratch receive;
  std::vector<double> area_up_to;
};

/// A point near one of the group's corners, uniform by area for uniform (x, y) in the unit square.
SurfacePoint sample_near(const VertexGroups& groups, std::uint32_t group, const std::vector<double>& area_up_to,
                         double x, double y) {
  const double wanted = x * area_up_to.back();
  auto at = std::upper_bound(area_up_to.begin(), area_up_to.end(), wanted);
  if (at == area_up_to.end()) --at;
  const auto k = static_cast<std::size_t>(at - area_up_to.begin());
  const double before = k > 0 ? area_up_to[k - 1] : 0;
  const double within = std::clamp((wanted - before) / (*at - before), 0.0, 1.0);
  const std::uint32_t corner = groups.corners[groups.first_corner[group] + k];
  // Weights of the two other corners.
  const double root = std::sqrt(within);
  const double next = kReach * root * (1 - y), last = kReach * root * y;
  const std::array<double, 3> from_corner = {1 - next - last, next, last};
  std::array<double, 3> weights{};
  for (std::uint32_t i = 0; i < 3; ++i) weights[(corner + i - corner / 3 * 3) % 3] = from_corner[i];
  return {corner / 3, weights[1], weights[2]};
}

/// Gives buried groups the mean of those that they share edges with, ring by ring.
std::uint64_t fill_buried(const VertexGroups& groups, std::vector<std::uint8_t>& is_known,
                          std::vector<Vec3>& irradiance) {
  std::uint64_t num_filled = 0;
  for (;;) {
    std::vector<Vec3> sums(irradiance.size());
    std::vector<std::uint32_t> counts(irradiance.size(), 0);
    for (const auto& triangle : groups.of_corner) {
      for (int k = 0; k < 3; ++k) {
        if (is_known[triangle[k]]) continue;
        for (const std::uint32_t other : {triangle[(k + 1) % 3], triangle[(k + 2) % 3]}) {
          if (!is_known[other]) continue;
          sums[triangle[k]] += irradiance[other];
          ++counts[triangle[k]];
        }
      }
    }
    bool is_any = false;
    for (std::size_t g = 0; g < irradiance.size(); ++g) {
      if (counts[g] == 0) continue;
      irradiance[g] = sums[g] / counts[g];
      is_known[g] = 1;
      is_any = true;
      ++num_filled;
    }
    if (!is_any) break;
  }
  return num_filled + static_cast<std::uint64_t>(std::count(is_known.begin(), is_known.end(), 0));
}

}  // namespace

VertexGather::VertexGather(const Surfaces& surfaces, const VertexGroups& groups)
    : surfaces_(surfaces),
      groups_(groups),
      estimate_(groups.size(), groups.size(), false, false),
      parts_(groups.size(), Receiver::Parts::kUnknown),
      parts_behind_(parts_),
      is_known_(groups.size(), 0) {}

void VertexGather::add_pass(const GatherScene& scene, int light_samples, double weight,
                            const std::function<void(std::uint64_t)>& on_done, std::stop_token stop,
                            GatherCounts& counts) {
  const auto num_replicates = static_cast<std::size_t>(scene.rows.replicates());
  const SobolPoints site_points(scene.rows.num_sites() / scene.rows.replicates());
  std::atomic<std::uint64_t> num_done = 0, num_rays = 0, num_light_rays = 0;
  std::vector<std::array<float, kMaxReplicates>> squares(groups_.size());
  estimate_.begin_pass(weight);
  for_each_range(groups_.size(), kGroupsPerTask, [&](std::size_t begin, std::size_t end) {
    Scratch scratch;
    for (std::size_t k = begin; k < end; ++k) {
      if (stop.stop_requested()) return;
      const auto g = static_cast<std::uint32_t>(k);
      double area = 0;
      scratch.area_up_to.clear();
      for (std::uint32_t c = groups_.first_corner[g]; c < groups_.first_corner[g + 1]; ++c) {
        area += surfaces_.areas[groups_.corners[c] / 3];
        scratch.area_up_to.push_back(area);
      }
      Receiver receiver{
          g,
          [&](double x, double y) { return front_site(surfaces_, sample_near(groups_, g, scratch.area_up_to, x, y)); },
          parts_[g], parts_behind_[g]};
      scratch.receive.sites.clear();
      for (std::size_t r = 0; r < num_replicates; ++r) {
        const auto seeds = SobolPoints::seeds_of(mixed_bits(seed_of(scene.seed, kSitesOfVertex, g) + r));
        for (int s = 0; s < site_points.size(); ++s) {
          scratch.receive.sites.push_back(
              receiver.site_at(site_points.coordinate(s, 0, seeds), site_points.coordinate(s, 1, seeds)));
        }
      }
      const Reception reception = receive(scene, receiver, seed_of(scene.seed, kRaysOfVertex, g),
                                          seed_of(scene.seed, kLightOfVertex, g), scratch.receive, light_samples);
      if (receiver.turned_out_cut(parts_[g], parts_behind_[g])) estimate_.forget(g);
      parts_[g] = receiver.parts;
      parts_behind_[g] = receiver.parts_behind;
      num_rays += reception.rays;
      num_light_rays += reception.light_rays;
      is_known_[g] = !reception.is_buried;
      if (reception.is_buried) continue;
      std::array<Vec3, kMaxReplicates> direct, gathered, coarser;
      for (std::size_t r = 0; r < num_replicates; ++r) {
        direct[r] = reception.replicates[r].direct;
        gathered[r] = reception.replicates[r].gathered;
        coarser[r] = reception.replicates[r].coarser;
      }
      const MeanAndVariance sent = mean_and_variance(std::span(direct).first(num_replicates));
      const MeanAndVariance arrived = mean_and_variance(std::span(gathered).first(num_replicates));
      for (std::size_t r = 0; r < num_replicates; ++r) {
        const Vec3 off = gathered[r] - arrived.mean;
        squares[g][r] = static_cast<float>(mean_component(scaled_by(off, off)));
      }
      estimate_.add(g, {sent.mean, arrived.mean, sent.variance, arrived.variance, {}, 0}, light_samples);
      estimate_.add_to_cell(g, mean_square_without_noise(std::span(coarser).first(num_replicates)), 0);
    }
    num_done += end - begin;
    if (on_done) on_done(num_done);
  });
  estimate_.end_pass();
  std::array<double, kMaxReplicates> sums{};
  for (const auto& own : squares) {
    for (std::size_t r = 0; r < num_replicates; ++r) sums[r] += own[r];
  }
  spread_.add_pass(weight, std::span(sums).first(num_replicates));
  counts.num_rays += num_rays;
  counts.num_light_rays += num_light_rays;
  counts.num_gathered += groups_.size();
}

GatheredVertices finish_vertices(const Surfaces& surfaces, const VertexGroups& groups, const VertexGather& gather) {
  GatheredVertices out;
  for (std::size_t g = 0; g < groups.size(); ++g) out.irradiance.push_back(gather.estimate().irradiance(g));
  std::vector<std::uint8_t> is_known = gather.is_known();
  out.num_filled = fill_buried(groups, is_known, out.irradiance);
  double flux = 0, area = 0;
  for (std::size_t t = 0; t < groups.of_corner.size(); ++t) {
    for (const std::uint32_t g : groups.of_corner[t]) {
      flux += surfaces.areas[t] * mean_component(out.irradiance[g]) / 3;
    }
    area += surfaces.areas[t];
  }
  out.mean_irradiance = area > 0 ? flux / area : 0;
  return out;
}

}  // namespace radbake::radiosity
