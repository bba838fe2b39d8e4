#include "server/radiosity/lights/direct_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/base/check.h"
#include "common/base/sequence.h"
#include "server/radiosity/lights/rectangle_sampling.h"
#include "server/radiosity/lights/triangle_sampling.h"
#include "server/radiosity/survey/facts.h"

namespace radbake::radiosity {
namespace {

/// Up to this many emitters are weighed one by one at each receiver; more of them by their tree.
constexpr std::size_t kMostWeighed = 64;
/// Nodes of a cut through the tree. Fewer are cheaper, and their choices worse by more than that.
constexpr std::size_t kMostInCut = 48;

/// Numbers that keep the seeds of lights apart; the emitters have the receiver's own.
enum Purpose : std::uint64_t { kSun = 31, kEnvironment = 32 };

/// A segment ends just before the emitter that it aims at: single precision must not carry it into it.
constexpr float kShadowReach = 1 - 0x1p-20f;

bool has_disc(const DirectionalLight& sun) { return sun.angular_diameter_radians > 0; }

std::array<float, 3> to_float(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// Cosine about the site's normal over the share of its lobe that lies above the surface; 0 from below either.
double receiving_cosine(const Site& site, Vec3 unit_direction) {
  if (dot(site.facing, unit_direction) <= 0) return 0;
  return std::max(0.0, dot(site.normal, unit_direction)) / (0.5 * (1 + dot(site.normal, site.facing)));
}

/// The sites of one replicate: its share of them, or all where there are fewer sites than replicates.
struct SiteRun {
  std::size_t first = 0, size = 0;

  SiteRun(std::size_t num_sites, std::size_t replicate, std::size_t num_replicates) {
    if (num_sites < num_replicates) {
      size = num_sites;
      return;
    }
    first = replicate * num_sites / num_replicates;
    size = (replicate + 1) * num_sites / num_replicates - first;
  }
  /// Several samples share a site, or the last sites have none: the first of a net are one too.
  std::size_t of_sample(std::size_t k, std::size_t samples) const {
    return first + (samples >= size ? k * size / samples : k);
  }
};

/// The same for all samples of all replicates.
void deal_sites(std::size_t num_replicates, std::size_t samples, std::size_t num_sites,
                std::vector<std::int32_t>& site_of) {
  if (num_sites == num_replicates * samples) {
    std::iota(site_of.begin(), site_of.begin() + static_cast<std::ptrdiff_t>(num_sites), 0);
    return;
  }
  std::size_t at = 0;
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const SiteRun run(num_sites, r, num_replicates);
    for (std::size_t k = 0; k < samples; ++k) site_of[at++] = static_cast<std::int32_t>(run.of_sample(k, samples));
  }
}

}  // namespace

DirectLight::DirectLight(const Surfaces& surfaces, const Visibility& visibility, int samples, Environment::Part part)
    : surfaces_(surfaces),
      visibility_(visibility),
      points_(samples),
      emitters_(make_emitters(surfaces)),
      columns_(emitters_),
      tree_(emitters_) {
  if (surfaces.environment != nullptr) environment_.emplace(*surfaces.environment, part);
  const auto in_scene = [&](Vec3 position) { return (position - surfaces.centre) / surfaces.metres_per_unit; };
  for (const Light& light : surfaces.lights) {
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      lamps_.push_back({in_scene(point->position), point->intensity, {}, false, 0, 0});
    } else if (const auto* spot = std::get_if<SpotLight>(&light.kind)) {
      const double inner = std::cos(spot->inner_cone_radians), outer = std::cos(spot->outer_cone_radians);
      lamps_.push_back({in_scene(spot->position), spot->intensity, spot->direction, true, outer,
                        1 / std::max(0.001, inner - outer)});
    } else if (const auto* luminaire = std::get_if<ProfileLight>(&light.kind)) {
      const Vec3 across = cross(luminaire->zero_side, luminaire->direction);
      lamps_.push_back({in_scene(luminaire->position), luminaire->tint, luminaire->direction, false, 0, 0,
                        luminaire->profile.get(), luminaire->zero_side, luminaire->is_mirrored ? -across : across});
    } else {
      suns_.push_back(std::get<DirectionalLight>(light.kind));
    }
  }
}

Vec3 DirectLight::Lamp::intensity_towards(Vec3 direction) const {
  const double cosine = dot(direction, axis);
  if (profile != nullptr) {
    return intensity * profile->intensity(cosine, dot(direction, zero_side), dot(direction, quarter_side));
  }
  if (!is_spot) return intensity;
  // Source: KHR_lights_punctual, inner and outer cone angles.
  const double linear = std::clamp((cosine - outer_cosine) * per_ramp, 0.0, 1.0);
  return intensity * (linear * linear);
}

Vec3 DirectLight::sent_by(std::uint32_t triangle) const {
  if (!surfaces_.is_see_through(triangle)) return surfaces_.exitances[triangle];
  // Of what is see-through, only the opaque part sends.
  constexpr int kPoints = 4096;  // holes are finer than what reflects
  const SobolPoints points(kPoints);
  const auto seeds = SobolPoints::seeds_of(triangle);
  Vec3 sum;
  for (int i = 0; i < kPoints; ++i) {
    SurfacePoint p{triangle, points.coordinate(i, 0, seeds), points.coordinate(i, 1, seeds)};
    if (p.u + p.v > 1) p.u = 1 - p.u, p.v = 1 - p.v;
    sum += scaled_by(surfaces_.exitance(p), surfaces_.opacity(p));
  }
  return sum / kPoints;
}

double DirectLight::emitted_lumens() const {
  const double square_metres = surfaces_.metres_per_unit * surfaces_.metres_per_unit;
  double lumens = 0;
  for (const Emitter& emitter : emitters_) {
    for (const std::uint32_t t : emitter.triangles) {
      if (t == Emitter::kNone) continue;
      const int sides = emitter.is_two_sided ? 2 : 1;
      lumens += surfaces_.areas[t] * mean_component(sent_by(t)) * square_metres * sides;
    }
  }
  for (const Light& light : surfaces_.lights) {
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      lumens += 4 * std::numbers::pi * mean_component(point->intensity);
    } else if (const auto* spot = std::get_if<SpotLight>(&light.kind)) {
      lumens += spot_lumens(*spot);
    } else if (const auto* luminaire = std::get_if<ProfileLight>(&light.kind)) {
      lumens += luminaire->profile->lumens() * mean_component(luminaire->tint);
    }
  }
  return lumens;
}

std::uint64_t DirectLight::estimate(std::span<const Site> sites, std::span<const std::uint8_t> is_buried,
                                    std::uint64_t seed, Scratch& scratch, std::span<Vec3> replicates,
                                    int samples) const {
  RADBAKE_CHECK_EQ(sites.size(), is_buried.size());
  std::fill(replicates.begin(), replicates.end(), Vec3{});
  scratch.open.clear();
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    if (!is_buried[s]) scratch.open.push_back(s);
  }
  if (scratch.open.empty() || is_dark()) return 0;

  // Collect segments and what each brings if nothing blocks it.
  const std::size_t per_replicate =
      static_cast<std::size_t>(samples > 0 ? samples : points_.size()) / replicates.size();
  scratch.segments.size = 0;
  if (!emitters_.empty()) sample_emitters(sites, seed, scratch, replicates.size(), per_replicate);
  sample_lamps(sites, scratch, replicates.size(), per_replicate);
  std::uint64_t purpose = 0;
  for (const DirectionalLight& sun : suns_) {
    if (!has_disc(sun)) continue;
    sample_sun(sun, sites, seed_of(seed, kSun, purpose++), scratch, replicates.size(), per_replicate);
  }
  if (has_sampled_environment()) {
    sample_environment(sites, seed_of(seed, kEnvironment, 0), scratch, replicates.size(), per_replicate);
  }

  // Add what arrives, in the order of the segments.
  const SegmentBuffer& segments = scratch.segments;
  const std::size_t n = segments.size;
  const std::span<const Ray> rays = std::span(segments.rays).first(n);
  if (visibility_.is_see_through()) {
    if (scratch.transmitted.size() < n) scratch.transmitted.resize(n);
    visibility_.transmitted(rays, std::span(scratch.transmitted).first(n));
    for (std::size_t i = 0; i < n; ++i) {
      replicates[segments.replicate_of[i]] += scaled_by(segments.contributions[i], scratch.transmitted[i]);
    }
  } else {
    if (scratch.blocked.size() < n) scratch.blocked.resize(n);
    visibility_.blocked(rays, std::span(scratch.blocked).first(n));
    for (std::size_t i = 0; i < n; ++i) {
      if (!scratch.blocked[i]) replicates[segments.replicate_of[i]] += segments.contributions[i];
    }
  }
  return n;
}

bool DirectLight::choose_emitters(Scratch& scratch, std::size_t num_samples, std::size_t samples) const {
  SampleColumns& chosen = scratch.samples;
  const std::size_t num_emitters = emitters_.size();
  const auto per_samples = 1 / static_cast<double>(samples);
  if (num_emitters > kMostWeighed) {
    tree_.cut(scratch.receiver, kMostInCut, scratch.cut);
    if (scratch.cut.parts.empty()) return false;
    for (std::size_t k = 0; k < num_samples; ++k) {
      const EmitterTree::Choice choice = tree_.choose(scratch.receiver, scratch.cut, chosen.z[k] * 0x1p-32);
      chosen.emitter[k] = std::max(choice.emitter, 0);
      chosen.slot[k] = static_cast<std::int32_t>(k);
      chosen.per_probability[k] = choice.probability > 0 ? static_cast<float>(per_samples / choice.probability) : 0.0f;
    }
    chosen.pad(num_samples);
    weigh_emitters(columns_, chosen.emitter, num_samples, scratch.receiver, scratch.seen);
    return true;
  }

  weigh_emitters(columns_, scratch.receiver, scratch.seen);
  const std::vector<float>& importance = scratch.seen.importance;
  if (num_emitters == 1) {
    std::fill_n(chosen.emitter.begin(), num_samples, 0);
    std::fill_n(chosen.slot.begin(), num_samples, 0);
    std::fill_n(chosen.per_probability.begin(), num_samples, static_cast<float>(per_samples));
    return importance[0] > 0;
  }
  scratch.cumulative.clear();
  double total = 0;
  for (std::size_t e = 0; e < num_emitters; ++e) {
    scratch.cumulative.push_back(total += static_cast<double>(importance[e]));
  }
  if (!(total > 0)) return false;
  for (std::size_t k = 0; k < num_samples; ++k) {
    const auto at =
        std::upper_bound(scratch.cumulative.begin(), scratch.cumulative.end(), chosen.z[k] * 0x1p-32 * total);
    auto e = std::min(static_cast<std::size_t>(at - scratch.cumulative.begin()), num_emitters - 1);
    // One without a share ends where it begins: go back to the last that has some.
    while (e > 0 && !(importance[e] > 0)) --e;
    chosen.emitter[k] = chosen.slot[k] = static_cast<std::int32_t>(e);
    chosen.per_probability[k] = static_cast<float>(per_samples * total / static_cast<double>(importance[e]));
  }
  return true;
}

void DirectLight::place_near(std::span<const Site> sites, Scratch& scratch, std::size_t num_samples) const {
  SampleColumns& samples = scratch.samples;
  for (std::size_t k = 0; k < num_samples; ++k) {
    if (scratch.seen.is_near[static_cast<std::size_t>(samples.slot[k])] == 0) continue;
    const Emitter& emitter = emitters_[static_cast<std::size_t>(samples.emitter[k])];
    const auto open_site = static_cast<std::size_t>(samples.site[k]);
    const Site& site = sites[scratch.open[open_site]];
    Vec3 direction;
    double solid_angle = 0, a = 0, b = 0;
    if (emitter.is_rectangle()) {
      const SphericalRectangle seen(emitter.corner, emitter.s, emitter.t, site.position);
      if (!(seen.solid_angle() > 0)) continue;
      const auto sample = seen.sample(samples.x[k], samples.y[k]);
      direction = sample.direction;
      a = sample.a;
      b = sample.b;
      solid_angle = seen.solid_angle();
    } else {
      const std::uint32_t t = emitter.triangles[0];
      const TriangleSample sample = sampled_triangle(surfaces_.corners[t], emitter.normal, emitter.area, site.position,
                                                     samples.x[k], samples.y[k]);
      direction = sample.direction;
      a = sample.u;
      b = sample.v;
      solid_angle = sample.solid_angle;
    }
    // weight = cos Omega / pi / (p n).
    samples.weight[k] = 0;
    const double distance = length(direction), height = dot(site.position - emitter.corner, emitter.normal);
    if (!(distance > 0) || (height <= 0 && !emitter.is_two_sided)) continue;
    const double cosine = receiving_cosine(site, direction / distance);
    samples.weight[k] = static_cast<float>(cosine * solid_angle / std::numbers::pi * samples.per_probability[k]);
    samples.a[k] = static_cast<float>(a);
    samples.b[k] = static_cast<float>(b);
    const double lift = height < 0 ? -emitter.lift : emitter.lift;
    samples.direction.set(
        k, direction + emitter.normal * lift - site.facing * static_cast<double>(scratch.receiver.lift[open_site]));
  }
}

void DirectLight::sample_emitters(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch,
                                  std::size_t num_replicates, std::size_t samples) const {
  const std::size_t num_samples = num_replicates * samples;
  SampleColumns& columns = scratch.samples;
  columns.make_room(num_samples);
  scratch.receiver.fill(sites, scratch.open, surfaces_);
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const std::size_t first = r * samples;
    points_.fill(mixed_bits(seed + r), samples, &columns.x[first], &columns.y[first], &columns.z[first]);
  }
  deal_sites(num_replicates, samples, scratch.open.size(), columns.site);
  if (!choose_emitters(scratch, num_samples, samples)) return;
  place_samples(columns_, scratch.seen, scratch.receiver, num_samples, columns);
  place_near(sites, scratch, num_samples);

  // Keep those that bring something.
  scratch.segments.make_room(num_samples);
  std::size_t k = 0;
  for (std::size_t r = 0; r < num_replicates; ++r) {
    for (const std::size_t end = k + samples; k < end; ++k) {
      const Emitter& emitter = emitters_[static_cast<std::size_t>(columns.emitter[k])];
      const bool is_kept = columns.weight[k] > 0;
      Vec3 exitance = emitter.exitance;
      if (emitter.varies && is_kept) {
        const SurfacePoint source = point_on(emitter, surfaces_, columns.a[k], columns.b[k]);
        exitance = surfaces_.exitance(source);
        if (emitter.is_see_through) exitance = scaled_by(exitance, surfaces_.opacity(source));
      }
      const Ray ray{scratch.receiver.origin[static_cast<std::size_t>(columns.site[k])],
                    {columns.direction.x[k], columns.direction.y[k], columns.direction.z[k]},
                    kShadowReach};
      scratch.segments.put(ray, exitance * columns.weight[k], r, is_kept);
    }
  }
}

void DirectLight::sample_lamps(std::span<const Site> sites, Scratch& scratch, std::size_t num_replicates,
                               std::size_t samples) const {
  // Each replicate looks at every lamp once from its sites, or from as many of them as it has samples.
  const std::size_t num_sites = scratch.open.size();
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const SiteRun run(num_sites, r, num_replicates);
    const std::size_t looks = std::min(samples, run.size);
    const double share = 1 / static_cast<double>(looks);
    for (std::size_t k = 0; k < looks; ++k) {
      const Site& site = sites[scratch.open[run.of_sample(k, looks)]];
      for (const Lamp& lamp : lamps_) {
        const Vec3 direction = lamp.position - site.position;
        const double distance = length(direction);
        if (distance <= 0) continue;
        const Vec3 unit = direction / distance;
        const double metres = distance * surfaces_.metres_per_unit;
        const Vec3 contribution = lamp.intensity_towards(-unit) * (receiving_cosine(site, unit) / (metres * metres));
        if (max_component(contribution) <= 0) continue;
        // Aim from the lifted origin at the lamp itself.
        const Vec3 lift = site.facing * surfaces_.ray_offsets[site.point.triangle];
        const auto from = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
        scratch.segments.add({from, to_float(direction - lift), 1}, contribution * share, r);
      }
      for (const DirectionalLight& sun : suns_) {
        if (has_disc(sun)) continue;
        add_ray(site, -sun.direction, sun.illuminance * (receiving_cosine(site, -sun.direction) * share), r, scratch);
      }
    }
  }
}

void DirectLight::add_ray(const Site& site, Vec3 direction, Vec3 contribution, std::size_t replicate,
                          Scratch& scratch) const {
  if (max_component(contribution) <= 0) return;
  const auto from = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
  scratch.segments.add({from, to_float(direction)}, contribution, replicate);
}

void DirectLight::sample_sun(const DirectionalLight& sun, std::span<const Site> sites, std::uint64_t seed,
                             Scratch& scratch, std::size_t num_replicates, std::size_t samples) const {
  const Frame towards(-sun.direction);
  const double sine = std::sin(sun.angular_diameter_radians / 2);
  const std::size_t of_disc = std::max<std::size_t>(1, samples / 2);
  SampleColumns& columns = scratch.samples;
  columns.make_room(of_disc);
  for (std::size_t r = 0; r < num_replicates; ++r) {
    points_.fill(mixed_bits(seed + r), of_disc, columns.x.data(), columns.y.data(), columns.z.data());
    const SiteRun run(scratch.open.size(), r, num_replicates);
    for (std::size_t k = 0; k < of_disc; ++k) {
      const Site& site = sites[scratch.open[run.of_sample(k, of_disc)]];
      // A disc of radius sin(alpha) lifted onto the sphere: density cos(gamma) / (pi sin^2 alpha).
      const double radius = sine * std::sqrt(static_cast<double>(columns.x[k]));
      const double around = 2 * std::numbers::pi * static_cast<double>(columns.y[k]);
      const double cosine = std::sqrt(1 - radius * radius);
      const Vec3 direction = towards.to_world({radius * std::cos(around), radius * std::sin(around), cosine});
      const double weight = receiving_cosine(site, direction) / (cosine * static_cast<double>(of_disc));
      add_ray(site, direction, sun.illuminance * weight, r, scratch);
    }
  }
}

void DirectLight::sample_environment(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch,
                                     std::size_t num_replicates, std::size_t samples) const {
  SampleColumns& columns = scratch.samples;
  columns.make_room(samples);
  for (std::size_t r = 0; r < num_replicates; ++r) {
    points_.fill(mixed_bits(seed + r), samples, columns.x.data(), columns.y.data(), columns.z.data());
    const SiteRun run(scratch.open.size(), r, num_replicates);
    for (std::size_t k = 0; k < samples; ++k) {
      const Site& site = sites[scratch.open[run.of_sample(k, samples)]];
      const Environment::Sample sample =
          environment_->sample(static_cast<double>(columns.x[k]), static_cast<double>(columns.y[k]));
      if (!(sample.density > 0)) continue;
      // H = L cos / (p n).
      const double weight = receiving_cosine(site, sample.direction) / (sample.density * static_cast<double>(samples));
      add_ray(site, sample.direction, sample.luminance * weight, r, scratch);
    }
  }
}

}  // namespace radbake::radiosity
