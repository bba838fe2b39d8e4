#include "server/radiosity/gather/gather.h"

#include <algorithm>
#include <mutex>

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
  ReceiveScratch receive;
};

struct Texel {
  Vec3 irradiance, indirect;
  double openness = 0;
  double coverage = 0;
  double area = 0;
  TexelState state = TexelState::kOutside;
  std::uint64_t rays = 0, light_rays = 0;
};

/// Writes a texel of a layer, where the layer is kept.
void put(Vec3 value, double coverage, std::size_t at, std::vector<float>& rgba) {
  if (rgba.empty()) return;
  for (int c = 0; c < 3; ++c) rgba[4 * at + static_cast<std::size_t>(c)] = static_cast<float>(value[c]);
  rgba[4 * at + 3] = static_cast<float>(coverage);
}

Texel gather_texel(const GatherScene& scene, const Atlas& atlas, const SobolPoints& site_points, int x, int y,
                   Scratch& scratch) {
  Texel texel;
  atlas.footprint(x, y, scratch.footprint);
  if (scratch.footprint.is_empty()) return texel;
  texel.coverage = scratch.footprint.coverage;
  texel.area = scratch.footprint.area();
  const std::uint64_t id = static_cast<std::uint64_t>(y) * atlas.width() + x;

  // Spread the sites over the footprint.
  scratch.receive.sites.clear();
  for (int r = 0; r < scene.rows.replicates(); ++r) {
    const auto seeds =
        SobolPoints::seeds_of(mixed_bits(seed_of(scene.seed, kSitesOfTexel, id) + static_cast<std::uint64_t>(r)));
    for (int s = 0; s < site_points.size(); ++s) {
      const SurfacePoint p =
          scratch.footprint.sample(site_points.coordinate(s, 0, seeds), site_points.coordinate(s, 1, seeds));
      scratch.receive.sites.push_back(front_site(scene.surfaces, p, scene.surfaces.shading_normal(p)));
    }
  }
  const Reception reception =
      receive(scene, seed_of(scene.seed, kRaysOfTexel, id), seed_of(scene.seed, kLightOfTexel, id), scratch.receive);
  const ReceivedLight light = reception.mean(scene.rows.replicates());
  texel.irradiance = light.irradiance();
  texel.indirect = light.reflected;
  texel.openness = reception.openness;
  texel.state = reception.is_buried ? TexelState::kBuried : TexelState::kValid;
  texel.rays = reception.rays;
  texel.light_rays = reception.light_rays;
  return texel;
}

}  // namespace

GatheredMap gather_lightmap(const GatherScene& scene, const Atlas& atlas, GatherLayers layers,
                            const std::function<void(const GatheredTile&)>& on_tile, std::stop_token stop) {
  const int width = atlas.width(), height = atlas.height();
  const int edge = std::max(width, height) > kLargeAtlas ? 2 * kTileEdge : kTileEdge;
  const int tiles_across = (width + edge - 1) / edge, tiles_down = (height + edge - 1) / edge;
  const std::size_t num_texels = static_cast<std::size_t>(atlas.num_rows()) * width;
  const SobolPoints site_points(scene.rows.num_sites() / scene.rows.replicates());

  GatheredMap map;
  map.rgba.assign(num_texels * 4, 0.0f);
  if (layers.direct) map.direct.assign(num_texels * 4, 0.0f);
  if (layers.indirect) map.indirect.assign(num_texels * 4, 0.0f);
  if (layers.openness) map.openness.assign(num_texels * 4, 0.0f);
  map.states.assign(num_texels, TexelState::kOutside);
  struct TileSums {
    std::uint64_t rays = 0, light_rays = 0;
    double flux = 0, area = 0;
  };
  std::vector<TileSums> sums(static_cast<std::size_t>(tiles_across) * tiles_down * atlas.num_sheets());
  std::mutex report_mutex;
  std::uint64_t texels_done = 0;

  const auto gather_tile = [&](int index) {
    Scratch scratch;
    GatheredTile tile;
    tile.sheet = index / (tiles_across * tiles_down);
    tile.x = index % tiles_across * edge;
    tile.y = index / tiles_across % tiles_down * edge;
    tile.width = std::min(edge, width - tile.x);
    tile.height = std::min(edge, height - tile.y);
    const int first_row = tile.sheet * height + tile.y;
    TileSums& own = sums[index];
    std::uint64_t texels = 0;
    for (int y = first_row; y < first_row + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        if (stop.stop_requested()) return;
        const Texel texel = gather_texel(scene, atlas, site_points, x, y, scratch);
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        map.states[at] = texel.state;
        put(texel.irradiance, texel.coverage, at, map.rgba);
        // What is not indirect: rounding must not make it negative.
        const Vec3 direct = texel.irradiance - texel.indirect;
        put({std::max(direct.x, 0.0), std::max(direct.y, 0.0), std::max(direct.z, 0.0)}, texel.coverage, at,
            map.direct);
        put(texel.indirect, texel.coverage, at, map.indirect);
        put(Vec3{1, 1, 1} * texel.openness, texel.coverage, at, map.openness);
        own.rays += texel.rays;
        own.light_rays += texel.light_rays;
        texels += texel.state != TexelState::kOutside;
        if (texel.state == TexelState::kValid) {
          own.area += texel.area;
          own.flux += texel.area * mean_component(texel.irradiance);
        }
      }
      tile.rgba.insert(tile.rgba.end(), map.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * width + tile.x),
                       map.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * width + tile.x + tile.width));
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
