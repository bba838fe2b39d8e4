#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/radiosity/lights/emitter_tree.h"
#include "server/radiosity/lights/emitters.h"
#include "server/radiosity/lights/environment.h"
#include "server/radiosity/lights/light_columns.h"
#include "server/radiosity/lights/light_points.h"
#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Light that arrives straight from small bright surfaces and lamps: the part of H^direct that rows leave out.
///
/// Surfaces: each sample chooses an emitter (a triangle, or a rectangle of two) by its likely share at the receiver,
/// and a point on it, uniform in solid angle where it is near, else in area with a density bilinear in what its corners
/// are likely to bring:
///
///   H = E/pi cos(theta) Omega V            H = E/pi cos(theta) cos(theta') A / r^2 V
///
/// Lamps: one shadow ray from each site. H = I cos(theta) / r^2 (point, spot, luminaire), H = E_sun cos(theta)
/// (directional). Suns with a disc of half-angle alpha: directions in the disc by the cosine to its middle, density
/// cos(gamma) / (pi sin^2 alpha), H = E_sun cos(theta) / cos(gamma) V. Skies of every direction: Environment.
/// About an interpolated normal, the part of the cosine lobe under the surface, (1 - n.g)/2, is taken out and the rest
/// scaled up, as the hemisphere rows do.
/// Units:  lx; intensities in cd, distances turned to metres.
/// Source: Shirley, Wang & Zimmerman 1996; Arvo 1995 (spherical triangles); Urena, Fajardo & King 2013 (spherical
/// rectangles); Hart et al. 2020 (bilinear warps); KHR_lights_punctual (falloff of spots).
class DirectLight {
 public:
  /// `part`: of a sky of every direction. A receiver that looks its dim part up along rays that escape asks for the
  /// bright one.
  DirectLight(const Surfaces& surfaces, const Visibility& visibility, int samples,
              Environment::Part part = Environment::Part::kAll);

  /// Whether there is anything to sample.
  bool is_dark() const { return emitters_.empty() && lamps_.empty() && suns_.empty() && !has_sampled_environment(); }
  int samples() const { return points_.size(); }
  /// Null: there is none.
  const Environment* environment() const { return environment_ ? &*environment_ : nullptr; }

  /// Buffers that one thread reuses from receiver to receiver.
  struct Scratch {
    std::vector<std::uint32_t> open;  ///< sites that count
    ReceiverColumns receiver;
    SeenEmitters seen;
    SampleColumns samples;
    std::vector<double> cumulative;  ///< [emitters] importance
    EmitterTree::Cut cut;
    SegmentBuffer segments;
    std::vector<std::uint8_t> blocked;
    std::vector<Vec3> transmitted;
  };

  /// Estimates irradiance as independent replicates, each with its share of the samples; their mean is the estimate.
  /// Shapes: sites [n], is_buried [n] (buried sites are left out), replicates [r]. Replicate k has its own samples from
  /// its own run of the sites that are left, k n / r up to (k + 1) n / r; fewer than r sites are shared by all.
  /// Replicates are independent where the sites of their runs are.
  /// `samples`: of all replicates, a multiple of r and at most samples(); 0: samples().
  /// Returns the number of shadow rays.
  std::uint64_t estimate(std::span<const Site> sites, std::span<const std::uint8_t> is_buried, std::uint64_t seed,
                         Scratch& scratch, std::span<Vec3> replicates, int samples = 0) const;

  /// Lumens that the emitters and lamps send out, mean of the three channels; suns do not count.
  double emitted_lumens() const;

 private:
  /// A point or spot light, or a luminaire.
  struct Lamp {
    Vec3 position;   ///< scene units
    Vec3 intensity;  ///< cd; of a luminaire its tint
    Vec3 axis;
    bool is_spot = false;
    double outer_cosine = 0, per_ramp = 0;  ///< of a spot
    const LightProfile* profile = nullptr;  ///< of a luminaire
    Vec3 zero_side = {};                    ///< where its horizontal angle is 0
    Vec3 quarter_side = {};                 ///< where it is 90 degrees
    /// In a direction away from it, unit length, cd.
    Vec3 intensity_towards(Vec3 direction) const;
  };

  /// Mean exitance of an emitter triangle with its holes.
  Vec3 sent_by(std::uint32_t triangle) const;
  bool has_sampled_environment() const { return environment_ && !environment_->is_empty(); }

  void sample_emitters(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch, std::size_t num_replicates,
                       std::size_t samples) const;
  /// Draws the emitters of all samples. False: none of them sends anything to the receiver.
  bool choose_emitters(Scratch& scratch, std::size_t num_samples, std::size_t samples) const;
  /// Places samples anew whose emitter is near: uniform over its solid angle.
  void place_near(std::span<const Site> sites, Scratch& scratch, std::size_t num_samples) const;
  void sample_lamps(std::span<const Site> sites, Scratch& scratch, std::size_t num_replicates,
                    std::size_t samples) const;
  void sample_sun(const DirectionalLight& sun, std::span<const Site> sites, std::uint64_t seed, Scratch& scratch,
                  std::size_t num_replicates, std::size_t samples) const;
  void sample_environment(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch, std::size_t num_replicates,
                          std::size_t samples) const;
  /// A ray into the open that brings `contribution` where nothing blocks it.
  void add_ray(const Site& site, Vec3 direction, Vec3 contribution, std::size_t replicate, Scratch& scratch) const;

  const Surfaces& surfaces_;
  const Visibility& visibility_;
  LightPoints points_;
  std::vector<Emitter> emitters_;
  EmitterColumns columns_;
  EmitterTree tree_;
  std::vector<Lamp> lamps_;
  std::vector<DirectionalLight> suns_;  ///< with a disc or without
  std::optional<Environment> environment_;
};

}  // namespace radbake::radiosity
