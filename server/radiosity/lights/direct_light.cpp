#include "server/radiosity/lights/direct_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "server/radiosity/lights/triangle_sampling.h"
#include "server/radiosity/survey/facts.h"

namespace radbake::radiosity {
namespace {

/// Up to this many emitter triangles are weighed at each receiver; beyond it they are chosen by power alone.
constexpr std::size_t kMaxWeighedEmitters = 1024;

/// Numbers that keep the seeds of lights apart; the emitters have the receiver's own.
enum Purpose : std::uint64_t { kSun = 31, kEnvironment = 32 };

bool has_disc(const DirectionalLight& sun) { return sun.angular_diameter_radians > 0; }

std::array<float, 3> to_float(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// Cosine about the site's normal over the share of its lobe that lies above the surface; 0 from below either.
double receiving_cosine(const Site& site, Vec3 unit_direction) {
  if (dot(site.facing, unit_direction) <= 0) return 0;
  return std::max(0.0, dot(site.normal, unit_direction)) / (0.5 * (1 + dot(site.normal, site.facing)));
}

/// The site of sample k of replicate r: runs of samples share a site, or replicates take turns at the sites.
std::size_t site_of_sample(std::size_t r, std::size_t k, std::size_t samples, std::size_t sites) {
  return samples >= sites ? k * sites / samples : (r * samples + k) % sites;
}

/// Share of a spot's intensity at an angle to its axis. Source: KHR_lights_punctual, inner and outer cone angles.
double spot_falloff(const SpotLight& spot, double cosine) {
  const double inner = std::cos(spot.inner_cone_radians), outer = std::cos(spot.outer_cone_radians);
  const double scale = 1 / std::max(0.001, inner - outer);
  const double linear = std::clamp((cosine - outer) * scale, 0.0, 1.0);
  return linear * linear;
}

}  // namespace

DirectLight::DirectLight(const Surfaces& surfaces, const Visibility& visibility, int samples, Environment::Part part)
    : surfaces_(surfaces), visibility_(visibility), points_(samples) {
  if (surfaces.environment != nullptr) environment_.emplace(*surfaces.environment, part);
  double sum = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    if (!surfaces.is_emitter[t]) continue;
    const auto& c = surfaces.corners[t];
    const double power = surfaces.areas[t] * max_component(surfaces.exitances[t]);
    emitters_.push_back({t, (c[0] + c[1] + c[2]) / 3, power});
    cumulative_power_.push_back(sum += power);
  }
}

Vec3 DirectLight::sent_by(std::uint32_t triangle) const {
  if (!surfaces_.is_see_through(triangle)) return surfaces_.exitances[triangle];
  // Of what is see-through, only the opaque part sends.
  constexpr int kPoints = 4096;  // holes are finer than what reflects
  static const SobolPoints points(kPoints);
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
    const int sides = surfaces_.material(emitter.triangle).is_double_sided ? 2 : 1;
    lumens += surfaces_.areas[emitter.triangle] * mean_component(sent_by(emitter.triangle)) * square_metres * sides;
  }
  for (const Light& light : surfaces_.lights) {
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      lumens += 4 * std::numbers::pi * mean_component(point->intensity);
    } else if (const auto* spot = std::get_if<SpotLight>(&light.kind)) {
      lumens += spot_lumens(*spot);
    }
  }
  return lumens;
}

std::uint64_t DirectLight::estimate(std::span<const Site> sites, std::span<const std::uint8_t> is_buried,
                                    std::uint64_t seed, Scratch& scratch, std::span<Vec3> replicates,
                                    int samples) const {
  const auto num_samples = static_cast<std::size_t>(samples > 0 ? samples : points_.size());
  RADBAKE_CHECK_EQ(sites.size(), is_buried.size());
  std::fill(replicates.begin(), replicates.end(), Vec3{});
  std::vector<const Site*> open;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    if (!is_buried[s]) open.push_back(&sites[s]);
  }
  if (open.empty() || is_dark()) return 0;

  scratch.segments.clear();
  scratch.contributions.clear();
  scratch.replicate_of.clear();
  if (!emitters_.empty()) sample_emitters(open, seed, scratch, replicates.size(), num_samples);
  sample_lamps(open, scratch, replicates.size());
  std::uint64_t purpose = 0;
  for (const Light& light : surfaces_.lights) {
    const auto* sun = std::get_if<DirectionalLight>(&light.kind);
    if (sun == nullptr || !has_disc(*sun)) continue;
    sample_sun(*sun, open, seed_of(seed, kSun, purpose++), scratch, replicates.size(), num_samples);
  }
  if (has_sampled_environment()) {
    sample_environment(open, seed_of(seed, kEnvironment, 0), scratch, replicates.size(), num_samples);
  }

  if (visibility_.is_see_through()) {
    scratch.transmitted.resize(scratch.segments.size());
    visibility_.transmitted(scratch.segments, scratch.transmitted);
    for (std::size_t i = 0; i < scratch.segments.size(); ++i) {
      replicates[scratch.replicate_of[i]] += scaled_by(scratch.contributions[i], scratch.transmitted[i]);
    }
  } else {
    scratch.blocked.resize(scratch.segments.size());
    visibility_.blocked(scratch.segments, scratch.blocked);
    for (std::size_t i = 0; i < scratch.segments.size(); ++i) {
      if (!scratch.blocked[i]) replicates[scratch.replicate_of[i]] += scratch.contributions[i];
    }
  }
  return scratch.segments.size();
}

void DirectLight::sample_emitters(const std::vector<const Site*>& sites, std::uint64_t seed, Scratch& scratch,
                                  std::size_t num_replicates, std::size_t num_samples) const {
  // Weigh the emitters at the middle of the receiver: power over squared distance, never zero.
  std::span<const double> cumulative = cumulative_power_;
  if (emitters_.size() > 1 && emitters_.size() <= kMaxWeighedEmitters) {
    Vec3 middle;
    for (const Site* site : sites) middle += site->position;
    middle = middle / static_cast<double>(sites.size());
    scratch.cumulative.clear();
    double sum = 0;
    for (const Emitter& emitter : emitters_) {
      const Vec3 d = emitter.centroid - middle;
      sum += emitter.power / std::max(dot(d, d), surfaces_.areas[emitter.triangle]);
      scratch.cumulative.push_back(sum);
    }
    cumulative = scratch.cumulative;
  }

  const std::size_t samples = num_samples / num_replicates;
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed + r));
    for (std::size_t k = 0; k < samples; ++k) {
      const int i = static_cast<int>(k);
      const Site& site = *sites[site_of_sample(r, k, samples, sites.size())];
      const double wanted = points_.coordinate(i, 2, seeds) * cumulative.back();
      const auto chosen = std::min<std::size_t>(
          std::upper_bound(cumulative.begin(), cumulative.end(), wanted) - cumulative.begin(), emitters_.size() - 1);
      const double probability = (cumulative[chosen] - (chosen > 0 ? cumulative[chosen - 1] : 0)) / cumulative.back();
      const std::uint32_t t = emitters_[chosen].triangle;

      const Vec3 normal = surfaces_.normals[t];
      const double height = dot(site.position - surfaces_.corners[t][0], normal);
      if (height <= 0 && !surfaces_.material(t).is_double_sided) continue;
      const TriangleSample sample = sampled_triangle(surfaces_.corners[t], normal, surfaces_.areas[t], site.position,
                                                     points_.coordinate(i, 0, seeds), points_.coordinate(i, 1, seeds));
      const double distance = length(sample.direction);
      if (!(sample.solid_angle > 0) || !(distance > 0)) continue;
      const double cosine = receiving_cosine(site, sample.direction / distance);
      if (cosine <= 0) continue;

      // H = E/pi cos Omega / (p n): the replicate's mean over its samples.
      const SurfacePoint source{t, sample.u, sample.v};
      const double weight =
          cosine * sample.solid_angle / (std::numbers::pi * probability * static_cast<double>(samples));
      const Vec3 facing = height > 0 ? normal : -normal;
      const auto from = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
      const auto to = lifted_origin(surfaces_, surfaces_.position(source), facing, t);
      scratch.segments.push_back({from, {to[0] - from[0], to[1] - from[1], to[2] - from[2]}, 1.0f});
      const Vec3 exitance = surfaces_.exitance(source) * weight;
      scratch.contributions.push_back(surfaces_.is_see_through(t) ? scaled_by(exitance, surfaces_.opacity(source))
                                                                  : exitance);
      scratch.replicate_of.push_back(static_cast<std::uint32_t>(r));
    }
  }
}

void DirectLight::sample_lamps(const std::vector<const Site*>& sites, Scratch& scratch,
                               std::size_t num_replicates) const {
  // Every site looks at every lamp once; replicates share the sites out where there are enough of them.
  const bool is_shared_out = sites.size() % num_replicates == 0;
  const std::size_t per_replicate = is_shared_out ? sites.size() / num_replicates : sites.size();
  for (const Light& light : surfaces_.lights) {
    const auto* sun = std::get_if<DirectionalLight>(&light.kind);
    if (sun != nullptr && has_disc(*sun)) continue;
    for (std::size_t r = 0; r < num_replicates; ++r) {
      for (std::size_t k = 0; k < per_replicate; ++k) {
        const Site& site = *sites[is_shared_out ? r * per_replicate + k : k];
        if (sun != nullptr) {
          const Vec3 contribution = sun->illuminance * receiving_cosine(site, -sun->direction);
          add_ray(site, -sun->direction, contribution / static_cast<double>(per_replicate), r, scratch);
          continue;
        }
        const auto* point = std::get_if<PointLight>(&light.kind);
        const auto* spot = std::get_if<SpotLight>(&light.kind);
        const Vec3 at = ((point ? point->position : spot->position) - surfaces_.centre) / surfaces_.metres_per_unit;
        const Vec3 direction = at - site.position;
        const double distance = length(direction);
        if (distance <= 0) continue;
        const Vec3 unit = direction / distance;
        const double metres = distance * surfaces_.metres_per_unit;
        const Vec3 intensity =
            point ? point->intensity : spot->intensity * spot_falloff(*spot, dot(-unit, spot->direction));
        const Vec3 contribution = intensity * (receiving_cosine(site, unit) / (metres * metres));
        if (max_component(contribution) <= 0) continue;
        // Aim from the lifted origin at the lamp itself.
        const Vec3 lift = site.facing * surfaces_.ray_offsets[site.point.triangle];
        const auto from = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
        scratch.segments.push_back({from, to_float(direction - lift), 1});
        scratch.contributions.push_back(contribution / static_cast<double>(per_replicate));
        scratch.replicate_of.push_back(static_cast<std::uint32_t>(r));
      }
    }
  }
}

void DirectLight::add_ray(const Site& site, Vec3 direction, Vec3 contribution, std::size_t replicate,
                          Scratch& scratch) const {
  if (max_component(contribution) <= 0) return;
  scratch.segments.push_back({lifted_origin(surfaces_, site.position, site.facing, site.point.triangle),
                              to_float(direction), std::numeric_limits<float>::infinity()});
  scratch.contributions.push_back(contribution);
  scratch.replicate_of.push_back(static_cast<std::uint32_t>(replicate));
}

void DirectLight::sample_sun(const DirectionalLight& sun, const std::vector<const Site*>& sites, std::uint64_t seed,
                             Scratch& scratch, std::size_t num_replicates, std::size_t num_samples) const {
  const Frame towards(-sun.direction);
  const double sine = std::sin(sun.angular_diameter_radians / 2);
  const std::size_t samples = std::max<std::size_t>(1, num_samples / 2 / num_replicates);
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed + r));
    for (std::size_t k = 0; k < samples; ++k) {
      const Site& site = *sites[site_of_sample(r, k, samples, sites.size())];
      // A disc of radius sin(alpha) lifted onto the sphere: density cos(gamma) / (pi sin^2 alpha).
      const double radius = sine * std::sqrt(points_.coordinate(static_cast<int>(k), 0, seeds));
      const double around = 2 * std::numbers::pi * points_.coordinate(static_cast<int>(k), 1, seeds);
      const double cosine = std::sqrt(1 - radius * radius);
      const Vec3 direction = towards.to_world({radius * std::cos(around), radius * std::sin(around), cosine});
      const double weight = receiving_cosine(site, direction) / (cosine * static_cast<double>(samples));
      add_ray(site, direction, sun.illuminance * weight, r, scratch);
    }
  }
}

void DirectLight::sample_environment(const std::vector<const Site*>& sites, std::uint64_t seed, Scratch& scratch,
                                     std::size_t num_replicates, std::size_t num_samples) const {
  const std::size_t samples = num_samples / num_replicates;
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed + r));
    for (std::size_t k = 0; k < samples; ++k) {
      const Site& site = *sites[site_of_sample(r, k, samples, sites.size())];
      const Environment::Sample sample = environment_->sample(points_.coordinate(static_cast<int>(k), 0, seeds),
                                                              points_.coordinate(static_cast<int>(k), 1, seeds));
      if (!(sample.density > 0)) continue;
      // H = L cos / (p n).
      const double weight = receiving_cosine(site, sample.direction) / (sample.density * static_cast<double>(samples));
      add_ray(site, sample.direction, sample.luminance * weight, r, scratch);
    }
  }
}

}  // namespace radbake::radiosity
