#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/sequence.h"
#include "server/radiosity/lights/environment.h"
#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Light that arrives straight from small bright surfaces and lamps: the part of H^direct that rows leave out.
///
/// Surfaces: each sample chooses an emitter triangle by its likely share at the receiver, and a point on it, uniform in
/// solid angle where it is near or large, else in area:
///
///   H = E/pi cos(theta) Omega V            H = E/pi cos(theta) cos(theta') A / r^2 V
///
/// Lamps: one shadow ray from each site. H = I cos(theta) / r^2 (point, spot), H = E_sun cos(theta) (directional).
/// Suns with a disc of half-angle alpha: directions in the disc by the cosine to its middle, density
/// cos(gamma) / (pi sin^2 alpha), H = E_sun cos(theta) / cos(gamma) V. Skies of every direction: Environment.
/// About an interpolated normal, the part of the cosine lobe under the surface, (1 - n.g)/2, is taken out and the rest
/// scaled up, as the hemisphere rows do.
/// Units:  lx; intensities in cd, distances turned to metres.
/// Source: Shirley, Wang & Zimmerman 1996; Arvo 1995 (spherical triangles); KHR_lights_punctual (falloff of spots).
class DirectLight {
 public:
  /// `part`: of a sky of every direction. A receiver that looks its dim part up along rays that escape asks for the
  /// bright one.
  DirectLight(const Surfaces& surfaces, const Visibility& visibility, int samples,
              Environment::Part part = Environment::Part::kAll);

  /// Whether there is anything to sample.
  bool is_dark() const { return emitters_.empty() && surfaces_.lights.empty() && !has_sampled_environment(); }
  int samples() const { return points_.size(); }
  /// Null: there is none.
  const Environment* environment() const { return environment_ ? &*environment_ : nullptr; }

  struct Scratch {
    std::vector<Ray> segments;
    std::vector<Vec3> contributions;
    std::vector<std::uint32_t> replicate_of;
    std::vector<std::uint8_t> blocked;
    std::vector<Vec3> transmitted;
    std::vector<double> cumulative;
  };

  /// Estimates irradiance as independent replicates, each with its share of the samples; their mean is the estimate.
  /// Shapes: sites [n], is_buried [n] (buried sites are left out), replicates [r].
  /// `samples`: of all replicates, a multiple of r and at most samples(); 0: samples().
  /// Returns the number of shadow rays.
  std::uint64_t estimate(std::span<const Site> sites, std::span<const std::uint8_t> is_buried, std::uint64_t seed,
                         Scratch& scratch, std::span<Vec3> replicates, int samples = 0) const;

  /// Lumens that the emitters and lamps send out, mean of the three channels; suns do not count.
  double emitted_lumens() const;

 private:
  struct Emitter {
    std::uint32_t triangle;
    Vec3 centroid;
    double power;  ///< area times exitance, largest of the channels
  };

  /// Mean exitance of an emitter with its holes.
  Vec3 sent_by(std::uint32_t triangle) const;
  void sample_emitters(const std::vector<const Site*>& sites, std::uint64_t seed, Scratch& scratch,
                       std::size_t num_replicates, std::size_t num_samples) const;
  void sample_lamps(const std::vector<const Site*>& sites, Scratch& scratch, std::size_t num_replicates) const;
  void sample_sun(const DirectionalLight& sun, const std::vector<const Site*>& sites, std::uint64_t seed,
                  Scratch& scratch, std::size_t num_replicates, std::size_t num_samples) const;
  void sample_environment(const std::vector<const Site*>& sites, std::uint64_t seed, Scratch& scratch,
                          std::size_t num_replicates, std::size_t num_samples) const;
  bool has_sampled_environment() const { return environment_ && !environment_->is_empty(); }
  /// A ray into the open that brings `contribution` where nothing blocks it.
  void add_ray(const Site& site, Vec3 direction, Vec3 contribution, std::size_t replicate, Scratch& scratch) const;

  const Surfaces& surfaces_;
  const Visibility& visibility_;
  SobolPoints points_;
  std::vector<Emitter> emitters_;
  std::vector<double> cumulative_power_;
  std::optional<Environment> environment_;
};

}  // namespace radbake::radiosity
