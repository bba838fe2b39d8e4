#include "server/radiosity/gather/gather.h"

#include <algorithm>
#include <mutex>
#include <numbers>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Numbers that keep the seeds of one purpose apart from those of another.
enum Purpose : std::uint64_t { kSitesOfTexel = 11, kRaysOfTexel = 12, kLightOfTexel = 13 };

/// Side of a tile, texels; twice that in a large atlas.
constexpr int kTileEdge = 32;
constexpr int kLargeAtlas = 1024;

/// Buffers of one thread.
struct Scratch {
  Footprint footprint;
  std::vector<Site> sites;
  HemisphereEstimator::Scratch hemisphere;
  DirectLight::Scratch light;
  RowSample row;
};

struct Texel {
  Vec3 irradiance;
  double coverage = 0;
  double area = 0;
  TexelState state = TexelState::kOutside;
  std::uint64_t rays = 0, light_rays = 0;
};

Texel gather_texel(const GatherScene& scene, const SobolPoints& site_points, int x, int y, Scratch& scratch) {
  Texel texel;
  scene.atlas.footprint(x, y, scratch.footprint);
  if (scratch.footprint.is_empty()) return texel;
  texel.coverage = scratch.footprint.coverage;
  texel.area = scratch.footprint.area();
  const std::uint64_t id = static_cast<std::uint64_t>(y) * scene.atlas.size() + x;

  // Spread the sites over the footprint.
  const auto seeds = SobolPoints::seeds_of(seed_of(scene.seed, kSitesOfTexel, id));
  scratch.sites.clear();
  for (int s = 0; s < site_points.size(); ++s) {
    const SurfacePoint p =
        scratch.footprint.sample(site_points.coordinate(s, 0, seeds), site_points.coordinate(s, 1, seeds));
    scratch.sites.push_back(front_site(scene.surfaces, p, scene.surfaces.shading_normal(p)));
  }

  // Gather what the patches reflect, and the sky.
  scene.rows.sample_row(scratch.sites, seed_of(scene.seed, kRaysOfTexel, id), scratch.hemisphere, scratch.row);
  texel.rays = scratch.row.traced;
  constexpr double kMinVisibleShare = 0.5;
  if (scratch.row.visible_share < kMinVisibleShare || scratch.row.counted == 0) {
    texel.state = TexelState::kBuried;
    return texel;
  }
  Vec3 sum = scene.sky * (std::numbers::pi * scratch.row.escaped);
  for (const std::uint32_t patch : scratch.row.arrivals) sum += scene.radiosity[patch];
  texel.irradiance = sum / scratch.row.counted;

  // Add what the lights send straight.
  Vec3 direct;
  texel.light_rays = scene.direct.estimate(scratch.sites, scratch.row.is_buried, seed_of(scene.seed, kLightOfTexel, id),
                                           scratch.light, std::span(&direct, 1));
  texel.irradiance += direct;
  texel.state = TexelState::kValid;
  return texel;
}

}  // namespace

GatheredMap gather_lightmap(const GatherScene& scene, const std::function<void(const GatheredTile&)>& on_tile,
                            std::stop_token stop) {
  const int size = scene.atlas.size();
  const int edge = size > kLargeAtlas ? 2 * kTileEdge : kTileEdge;
  const int tiles = (size + edge - 1) / edge;
  const SobolPoints site_points(scene.rows.num_sites());

  GatheredMap map;
  map.rgba.assign(static_cast<std::size_t>(size) * size * 4, 0.0f);
  map.states.assign(static_cast<std::size_t>(size) * size, TexelState::kOutside);
  struct TileSums {
    std::uint64_t rays = 0, light_rays = 0;
    double flux = 0, area = 0;
  };
  std::vector<TileSums> sums(static_cast<std::size_t>(tiles) * tiles);
  std::mutex report_mutex;
  std::uint64_t texels_done = 0;

  const auto gather_tile = [&](int index) {
    Scratch scratch;
    GatheredTile tile;
    tile.x = index % tiles * edge;
    tile.y = index / tiles * edge;
    tile.width = std::min(edge, size - tile.x);
    tile.height = std::min(edge, size - tile.y);
    TileSums& own = sums[index];
    std::uint64_t texels = 0;
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        if (stop.stop_requested()) return;
        const Texel texel = gather_texel(scene, site_points, x, y, scratch);
        const std::size_t at = static_cast<std::size_t>(y) * size + x;
        map.states[at] = texel.state;
        for (int c = 0; c < 3; ++c) map.rgba[4 * at + c] = static_cast<float>(texel.irradiance[c]);
        map.rgba[4 * at + 3] = static_cast<float>(texel.coverage);
        own.rays += texel.rays;
        own.light_rays += texel.light_rays;
        texels += texel.state != TexelState::kOutside;
        if (texel.state == TexelState::kValid) {
          own.area += texel.area;
          own.flux += texel.area * mean_component(texel.irradiance);
        }
      }
      tile.rgba.insert(tile.rgba.end(), map.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * size + tile.x),
                       map.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * size + tile.x + tile.width));
    }
    const std::scoped_lock lock(report_mutex);
    texels_done += texels;
    tile.texels_done = texels_done;
    if (on_tile) on_tile(tile);
  };
  for_each_range(sums.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t index = begin; index < end; ++index) gather_tile(static_cast<int>(index));
  });

  double flux = 0, area = 0;
  for (const TileSums& tile : sums) {
    map.num_rays += tile.rays;
    map.num_light_rays += tile.light_rays;
    flux += tile.flux;
    area += tile.area;
  }
  map.mean_irradiance = area > 0 ? flux / area : 0;
  map.is_cancelled = stop.stop_requested();
  return map;
}

}  // namespace radbake::radiosity
