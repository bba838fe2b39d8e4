#include "server/radiosity/gather/gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Numbers that keep the seeds of one purpose apart from those of another.
enum Purpose : std::uint64_t { kSitesOfTexel = 11, kRaysOfTexel = 12, kLightOfTexel = 13, kMoreLightOfTexel = 14 };

/// Side of a tile, texels; twice that in a large atlas.
constexpr int kTileEdge = 32;
constexpr int kLargeAtlas = 1024;
/// A square is interpolated where what its nodes see is further away than this, in lengths of its side.
constexpr double kNear = 0.75;
/// Adds the squares of the replicates' distances from their mean, mean of the channels.
void add_squares(std::span<const Vec3> replicates, Vec3 mean, std::array<double, kMaxReplicates>& squares) {
  for (std::size_t r = 0; r < replicates.size(); ++r) {
    const Vec3 off = replicates[r] - mean;
    squares[r] += mean_component(scaled_by(off, off));
  }
}

/// Shadow rays that one place of a texel sends where there are many: more would tell that place's light better, and not
/// the texel's, where a pattern of light and shadow is finer than a texel.
constexpr int kSamplesPerSite = 4;
/// Sites of a texel whose shadow rays are few.
constexpr int kFewSites = 16;

/// A multiple of the replicates.
int num_light_sites(int samples, int replicates) {
  const int most = std::max(kFewSites, samples / kSamplesPerSite);
  return std::clamp(samples, replicates, most) / replicates * replicates;
}

using Replicates = std::array<Vec3, kMaxReplicates>;

}  // namespace

struct LightmapGather::NodeLight {
  std::array<std::array<float, 3>, kMaxReplicates> gathered{};
  std::array<float, 3> reflected{};
  float openness = 0;
  float coarser_square = 0;
  float nearest = 0;  ///< harmonic mean of the distances that its rays went, scene units
  bool sees_light = false;
};

struct LightmapGather::Scratch {
  Footprint footprint;
  ReceiveScratch receive;
  std::vector<Site> known_sites;
  DirectLight::Scratch light;
  std::vector<std::uint8_t> none_is_out;
  struct Cell {
    double square = 0;
    int num = 0;
  } cell;
  GatherCounts counts;
};

LightmapGather::LightmapGather(const Surfaces& surfaces, const Atlas& atlas, const Visibility& shadows, int spacing,
                               bool keeps_parts, bool keeps_openness)
    : surfaces_(surfaces),
      atlas_(atlas),
      cells_across_((static_cast<std::size_t>(atlas.width()) + LightEstimate::kCell - 1) / LightEstimate::kCell),
      roles_(surfaces, atlas, shadows, spacing),
      estimate_(static_cast<std::size_t>(atlas.num_rows()) * atlas.width(),
                cells_across_ *
                    ((static_cast<std::size_t>(atlas.num_rows()) + LightEstimate::kCell - 1) / LightEstimate::kCell),
                keeps_parts, keeps_openness),
      facts_(estimate_.size()),
      cell_has_light_(estimate_.num_cells()) {}

Site LightmapGather::site_at(const Footprint& footprint, double u, double v) const {
  return front_site(surfaces_, footprint.sample(u, v));
}

int LightmapGather::light_samples_of(const GatherPass& pass, std::size_t texel) const {
  const int replicates = pass.alone.rows.replicates();
  return pass.light_levels.empty() ? pass.light_samples : replicates << pass.light_levels[texel];
}

void LightmapGather::place_sites(const GatherScene& scene, const SobolPoints& points, int x, int y,
                                 Scratch& scratch) const {
  const std::uint64_t seed = seed_of(scene.seed, kSitesOfTexel, static_cast<std::uint64_t>(y) * atlas_.width() + x);
  scratch.receive.sites.clear();
  for (int r = 0; r < scene.rows.replicates(); ++r) {
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed + static_cast<std::uint64_t>(r)));
    for (int s = 0; s < points.size(); ++s) {
      scratch.receive.sites.push_back(
          site_at(scratch.footprint, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds)));
    }
  }
}

void LightmapGather::place_light_sites(const GatherScene& scene, int x, int y, int num_sites, Scratch& scratch) const {
  const bool has_home = roles_.home(x, y) != TexelRoles::kNoTriangle;
  const std::uint64_t seed = seed_of(scene.seed, kSitesOfTexel, static_cast<std::uint64_t>(y) * atlas_.width() + x);
  scratch.receive.sites.clear();
  for (int s = 0; s < num_sites; ++s) {
    const std::uint64_t bits = mixed_bits(seed + static_cast<std::uint64_t>(s));
    const double u = static_cast<double>(bits >> 32) * 0x1p-32, v = static_cast<double>(bits & 0xffffffffu) * 0x1p-32;
    scratch.receive.sites.push_back(has_home ? front_site(surfaces_, roles_.point_at_home(x, y, u, v))
                                             : site_at(scratch.footprint, u, v));
  }
  scratch.none_is_out.assign(scratch.receive.sites.size(), 0);
}

bool LightmapGather::gather_alone(const GatherPass& pass, const GatherScene& scene, const SobolPoints& points, int x,
                                  int y, Scratch& scratch, NodeLight* node) {
  atlas_.footprint(x, y, scratch.footprint);
  if (scratch.footprint.is_empty()) return false;
  const std::uint64_t id = static_cast<std::uint64_t>(y) * atlas_.width() + x;
  TexelFacts& facts = facts_[id];
  facts.coverage = static_cast<float>(scratch.footprint.coverage);
  facts.area = static_cast<float>(scratch.footprint.area());
  facts.is_emitter = std::any_of(scratch.footprint.pieces.begin(), scratch.footprint.pieces.end(),
                                 [&](const FootprintPiece& piece) { return surfaces_.is_emitter[piece.triangle]; });
  place_sites(scene, points, x, y, scratch);
  Receiver receiver{id, [this, &scratch](double u, double v) { return site_at(scratch.footprint, u, v); }, facts.parts,
                    facts.parts_behind};
  // The sites that rays leave from send shadow rays too, as many as is of use there; of a part or two sides, all.
  const int samples = light_samples_of(pass, id);
  const bool has_two_sides = surfaces_.is_translucent(scratch.receive.sites.front().point.triangle);
  const int of_sites = facts.parts == Receiver::Parts::kSeveral || has_two_sides
                           ? samples
                           : std::min(samples, kSamplesPerSite * static_cast<int>(scratch.receive.sites.size()));
  const Reception reception = receive(scene, receiver, seed_of(scene.seed, kRaysOfTexel, id),
                                      seed_of(scene.seed, kLightOfTexel, id), scratch.receive, of_sites);
  if (receiver.turned_out_cut(facts.parts, facts.parts_behind)) estimate_.forget(id);
  facts.parts = receiver.parts;
  facts.parts_behind = receiver.parts_behind;
  scratch.counts.num_rays += reception.rays;
  scratch.counts.num_light_rays += reception.light_rays;
  ++scratch.counts.num_gathered;
  facts.state = reception.is_buried ? TexelState::kBuried : TexelState::kValid;
  if (reception.is_buried) return false;

  const auto num_replicates = static_cast<std::size_t>(scene.rows.replicates());
  Replicates direct, gathered, coarser;
  for (std::size_t r = 0; r < num_replicates; ++r) {
    direct[r] = reception.replicates[r].direct;
    gathered[r] = reception.replicates[r].gathered;
    coarser[r] = reception.replicates[r].coarser;
  }
  // Where all of the texel counts, others of its places send the rest.
  const int rest = reception.visible_share == 1 ? samples - of_sites : 0;
  if (rest > 0) {
    Replicates others;
    scratch.known_sites = scratch.receive.sites;
    place_light_sites(scene, x, y, num_light_sites(rest, scene.rows.replicates()), scratch);
    replace_unseen_sites(scene, scratch.known_sites, scratch.receive);
    scratch.counts.num_light_rays +=
        scene.direct.estimate(scratch.receive.sites, scratch.none_is_out, seed_of(scene.seed, kMoreLightOfTexel, id),
                              scratch.light, std::span(others).first(num_replicates), rest);
    const double share = static_cast<double>(rest) / samples;
    for (std::size_t r = 0; r < num_replicates; ++r) direct[r] += (others[r] - direct[r]) * share;
  }
  const MeanAndVariance sent = mean_and_variance(std::span(direct).first(num_replicates));
  const MeanAndVariance arrived = mean_and_variance(std::span(gathered).first(num_replicates));
  add_squares(std::span(gathered).first(num_replicates), arrived.mean, scratch.counts.squares);
  const Vec3 reflected = reception.mean(scene.rows.replicates()).reflected;
  estimate_.add(id, {sent.mean, arrived.mean, sent.variance, arrived.variance, reflected, reception.openness},
                of_sites + rest);
  const double coarser_square = mean_square_without_noise(std::span(coarser).first(num_replicates));
  if (node == nullptr) {
    scratch.cell.square += coarser_square;
    ++scratch.cell.num;
  } else {
    node->coarser_square = static_cast<float>(coarser_square);
    for (std::size_t r = 0; r < num_replicates; ++r) {
      for (int c = 0; c < 3; ++c) node->gathered[r][static_cast<std::size_t>(c)] = static_cast<float>(gathered[r][c]);
    }
    for (int c = 0; c < 3; ++c) node->reflected[static_cast<std::size_t>(c)] = static_cast<float>(reflected[c]);
    node->openness = static_cast<float>(reception.openness);
    double sum = 0;
    const auto& hits = scratch.receive.hemisphere.hits;
    for (const Hit& hit : hits) sum += hit.triangle == kNoHit ? 0 : 1 / std::max(hit.distance, 1e-30f);
    node->nearest =
        sum > 0 ? static_cast<float>(static_cast<double>(hits.size()) / sum) : std::numeric_limits<float>::infinity();
    node->sees_light = reception.visible_share == 1;
  }
  return true;
}

bool LightmapGather::gather_nodes(const GatherPass& pass, std::stop_token stop, const std::function<bool()>& is_over,
                                  std::vector<NodeLight>& nodes, GatherCounts& counts) {
  if (roles_.num_nodes() == 0) return true;
  nodes.assign(roles_.num_nodes(), {});
  const auto rows = roles_.num_nodes() / static_cast<std::size_t>(roles_.nodes_across());
  const SobolPoints points(pass.nodes.rows.num_sites() / pass.nodes.rows.replicates());
  std::vector<GatherCounts> of_row(rows);
  std::vector<std::uint8_t> is_left_out(rows, 0);
  for_each_range(rows, 1, [&](std::size_t begin, std::size_t end) {
    Scratch scratch;
    for (std::size_t j = begin; j < end; ++j) {
      is_left_out[j] = is_over && is_over();
      if (is_left_out[j]) continue;
      scratch.counts = {};
      for (int i = 0; i < roles_.nodes_across(); ++i) {
        if (stop.stop_requested()) return;
        if (!roles_.is_node(i, static_cast<int>(j))) continue;
        const int x = i * roles_.spacing(), y = static_cast<int>(j) * roles_.spacing();
        NodeLight& node = nodes[j * static_cast<std::size_t>(roles_.nodes_across()) + static_cast<std::size_t>(i)];
        gather_alone(pass, pass.nodes, points, x, y, scratch, &node);
      }
      of_row[j] = scratch.counts;
    }
  });
  for (const GatherCounts& row : of_row) counts += row;
  return std::find(is_left_out.begin(), is_left_out.end(), 1) == is_left_out.end();
}

void LightmapGather::judge_squares(const std::vector<NodeLight>& nodes) {
  const auto below = static_cast<std::size_t>(roles_.nodes_across());
  roles_.for_each_plain_square([&](int i, int j) {
    const std::size_t first = static_cast<std::size_t>(j) * below + static_cast<std::size_t>(i);
    double nearest = std::numeric_limits<double>::infinity();
    bool see_light = true;
    for (const std::size_t node : {first, first + 1, first + below, first + below + 1}) {
      nearest = std::min<double>(nearest, nodes[node].nearest);
      see_light = see_light && nodes[node].sees_light;
    }
    // The side of the square, from the texels' area.
    const double side = roles_.spacing() * std::sqrt(facts_[texel_of_node(i, j)].area);
    if (!see_light || nearest < kNear * side) roles_.refuse(i, j);
  });
}

double LightmapGather::interpolation_square(const std::vector<NodeLight>& nodes, int i, int j) const {
  // A bilinear patch over squares is off by x (1 - x) f_xx / 2 along x, f_xx being the second difference over the
  // squares: its mean square is f_xx^2 / 120, and of both directions together at most this.
  constexpr double kShare = 1.0 / 120 + 1.0 / 144;
  const auto across = static_cast<std::size_t>(roles_.nodes_across());
  const auto is_plain = [&](int a, int b) { return a >= 0 && b >= 0 && roles_.is_plain(a, b); };
  double sum = 0;
  int num = 0;
  const auto add = [&](int a, int b, bool along_x) {
    const std::size_t at = static_cast<std::size_t>(b) * across + static_cast<std::size_t>(a);
    const std::size_t step = along_x ? 1 : across;
    Replicates second;
    for (std::size_t r = 0; r < kMaxReplicates; ++r) {
      for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        second[r][c] = nodes[at - step].gathered[r][k] - 2 * nodes[at].gathered[r][k] + nodes[at + step].gathered[r][k];
      }
    }
    sum += mean_square_without_noise(second);
    ++num;
  };
  for (int b = j; b <= j + 1; ++b) {
    if (is_plain(i - 1, j)) add(i, b, true);
    if (is_plain(i + 1, j)) add(i + 1, b, true);
  }
  for (int a = i; a <= i + 1; ++a) {
    if (is_plain(i, j - 1)) add(a, j, false);
    if (is_plain(i, j + 1)) add(a, j + 1, false);
  }
  // Both directions: twice the mean of what was found of them.
  return num > 0 ? 2 * kShare * sum / num : 0;
}

void LightmapGather::gather_between(const GatherPass& pass, const std::vector<NodeLight>& nodes,
                                    const TexelRoles::Between& between, int x, int y, Scratch& scratch) {
  const GatherScene& scene = pass.alone;
  const std::size_t id = static_cast<std::size_t>(y) * atlas_.width() + x;
  TexelFacts& facts = facts_[id];
  const bool has_home = roles_.home(x, y) != TexelRoles::kNoTriangle;
  const int samples = light_samples_of(pass, id);
  const auto num_replicates = static_cast<std::size_t>(scene.rows.replicates());

  if (!has_home) atlas_.footprint(x, y, scratch.footprint);
  place_light_sites(scene, x, y, num_light_sites(samples, scene.rows.replicates()), scratch);
  if (facts.state == TexelState::kOutside) {
    const std::uint32_t t = scratch.receive.sites[0].point.triangle;
    facts.coverage = 1;
    facts.is_emitter = surfaces_.is_emitter[t] != 0;
    const double texel_area = has_home ? std::fabs(twice_area(atlas_.layout().corners[t])) / 2 : 0;
    facts.area = static_cast<float>(has_home ? surfaces_.areas[t] / texel_area : scratch.footprint.area());
    facts.state = TexelState::kValid;
  }

  Replicates direct;
  scratch.counts.num_light_rays +=
      scene.direct.estimate(scratch.receive.sites, scratch.none_is_out, seed_of(scene.seed, kLightOfTexel, id),
                            scratch.light, std::span(direct).first(num_replicates), samples);
  Replicates gathered{};
  Vec3 reflected;
  double openness = 0;
  for (std::size_t k = 0; k < between.nodes.size(); ++k) {
    const NodeLight& node = nodes[between.nodes[k]];
    const double weight = between.weights[k];
    for (std::size_t r = 0; r < num_replicates; ++r) {
      gathered[r] += Vec3{node.gathered[r][0], node.gathered[r][1], node.gathered[r][2]} * weight;
    }
    reflected += Vec3{node.reflected[0], node.reflected[1], node.reflected[2]} * weight;
    openness += node.openness * weight;
  }
  const MeanAndVariance sent = mean_and_variance(std::span(direct).first(num_replicates));
  const MeanAndVariance arrived = mean_and_variance(std::span(gathered).first(num_replicates));
  add_squares(std::span(gathered).first(num_replicates), arrived.mean, scratch.counts.squares);
  estimate_.add(id, {sent.mean, arrived.mean, sent.variance, arrived.variance, reflected, openness}, samples);
}

bool LightmapGather::add_pass(const GatherPass& pass, const std::function<void(const GatheredTile&)>& on_tile,
                              std::stop_token stop, const std::function<bool()>& is_over, GatherCounts& counts) {
  const int width = atlas_.width(), height = atlas_.height();
  const int edge = std::max(width, height) > kLargeAtlas ? 2 * kTileEdge : kTileEdge;
  const int tiles_across = (width + edge - 1) / edge, tiles_down = (height + edge - 1) / edge;
  const SobolPoints points(pass.alone.rows.num_sites() / pass.alone.rows.replicates());

  estimate_.begin_pass(pass.weight);
  std::vector<NodeLight> nodes;
  if (!gather_nodes(pass, stop, is_over, nodes, counts) || stop.stop_requested()) return false;
  judge_squares(nodes);

  const auto num_tiles = static_cast<std::size_t>(tiles_across) * tiles_down * atlas_.num_sheets();
  std::vector<GatherCounts> of_tile(num_tiles);
  std::vector<std::uint8_t> is_left_out(num_tiles, 0);
  std::mutex report_mutex;
  std::uint64_t texels_done = 0;
  const auto gather_tile = [&](std::size_t index, Scratch& scratch) {
    GatheredTile tile;
    const auto at = static_cast<int>(index);
    tile.sheet = at / (tiles_across * tiles_down);
    tile.x = at % tiles_across * edge;
    tile.y = at / tiles_across % tiles_down * edge;
    tile.width = std::min(edge, width - tile.x);
    tile.height = std::min(edge, height - tile.y);
    const int first_row = tile.sheet * height + tile.y;
    scratch.counts = {};
    std::uint64_t texels = 0;
    // Cell by cell, as each keeps sums of its own.
    constexpr int kCell = LightEstimate::kCell;
    for (int cy = first_row; cy < first_row + tile.height; cy += kCell) {
      for (int cx = tile.x; cx < tile.x + tile.width; cx += kCell) {
        scratch.cell = {};
        double interpolated = 0;
        bool has_light = false;
        for (int y = cy; y < std::min(cy + kCell, first_row + tile.height); ++y) {
          for (int x = cx; x < std::min(cx + kCell, tile.x + tile.width); ++x) {
            if (stop.stop_requested()) return;
            const std::size_t id = static_cast<std::size_t>(y) * width + x;
            const int spacing = roles_.spacing();
            if (spacing > 1 && x % spacing == 0 && y % spacing == 0 && roles_.is_node(x / spacing, y / spacing)) {
              // Done already, but for its cell.
              const int i = x / spacing, j = y / spacing;
              const NodeLight& node =
                  nodes[static_cast<std::size_t>(j) * static_cast<std::size_t>(roles_.nodes_across()) +
                        static_cast<std::size_t>(i)];
              if (facts_[id].state == TexelState::kValid) {
                scratch.cell.square += node.coarser_square;
                ++scratch.cell.num;
              }
              if (roles_.is_plain(i, j)) interpolated = interpolation_square(nodes, i, j);
            } else if (const auto between = roles_.between(x, y)) {
              gather_between(pass, nodes, *between, x, y, scratch);
            } else {
              gather_alone(pass, pass.alone, points, x, y, scratch, nullptr);
            }
            texels += facts_[id].state != TexelState::kOutside;
            has_light |= facts_[id].state == TexelState::kValid;
          }
        }
        const double patch_square = scratch.cell.num > 0 ? scratch.cell.square / scratch.cell.num : 0;
        const std::size_t cell = cell_of(static_cast<std::size_t>(cy) * width + cx);
        estimate_.add_to_cell(cell, patch_square, interpolated);
        cell_has_light_[cell] = has_light;
      }
    }
    of_tile[index] = scratch.counts;
    if (!on_tile) return;
    tile.rgba.reserve(static_cast<std::size_t>(tile.width) * tile.height * 4);
    for (int y = first_row; y < first_row + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        const std::size_t id = static_cast<std::size_t>(y) * width + x;
        const Vec3 irradiance = estimate_.irradiance(id);
        for (int c = 0; c < 3; ++c) tile.rgba.push_back(static_cast<float>(irradiance[c]));
        tile.rgba.push_back(facts_[id].coverage);
      }
    }
    const std::scoped_lock lock(report_mutex);
    texels_done += texels;
    tile.texels_done = texels_done;
    on_tile(tile);
  };
  for_each_range(num_tiles, 1, [&](std::size_t begin, std::size_t end) {
    Scratch scratch;
    for (std::size_t index = begin; index < end; ++index) {
      is_left_out[index] = is_over && is_over();
      if (!is_left_out[index]) gather_tile(index, scratch);
    }
  });
  for (const GatherCounts& tile : of_tile) counts += tile;
  if (stop.stop_requested()) return false;
  estimate_.end_pass();
  spread_.add_pass(pass.weight,
                   std::span(counts.squares).first(static_cast<std::size_t>(pass.alone.rows.replicates())));
  return std::find(is_left_out.begin(), is_left_out.end(), 1) == is_left_out.end();
}

GatherCounts& GatherCounts::operator+=(const GatherCounts& other) {
  num_rays += other.num_rays;
  num_light_rays += other.num_light_rays;
  num_gathered += other.num_gathered;
  for (std::size_t r = 0; r < squares.size(); ++r) squares[r] += other.squares[r];
  return *this;
}

double LightmapGather::mean_irradiance() const {
  double flux = 0, area = 0;
  for (std::size_t i = 0; i < facts_.size(); ++i) {
    if (facts_[i].state != TexelState::kValid) continue;
    area += facts_[i].area;
    flux += facts_[i].area * mean_component(estimate_.irradiance(i));
  }
  return area > 0 ? flux / area : 0;
}

}  // namespace radbake::radiosity
