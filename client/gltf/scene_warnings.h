#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/gltf/read_materials.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// What reading a scene counted and its warnings tell.
struct ReadCounts {
  std::vector<double> area_m2;              ///< of each material of the scene, one side
  std::vector<double> limited_area_m2;      ///< of it, that whose reflectance is above the limit
  std::uint64_t num_triangles_dropped = 0;  ///< of zero area
  std::uint64_t num_points_and_lines = 0;   ///< primitives, with every instance
  std::uint64_t num_skinned = 0;
  double morphed_area_m2 = 0;            ///< of meshes whose morph targets have weights
  double recolored_area_m2 = 0;          ///< of meshes with colours outside 0 to 1
  double translucent_color_area_m2 = 0;  ///< of masked and blended meshes whose COLOR_0 has opacity below 1
  double renormaled_area_m2 = 0;         ///< of meshes where unusable normals were replaced
  double total_area_m2 = 0;
};

/// Warnings in a fixed order, each with its share of the scene's area where it has one.
std::vector<Warning> scene_warnings(std::span<const Material> materials, std::span<const MaterialFacts> facts,
                                    const ReadCounts& counts, const std::vector<std::string>& ignored_extensions,
                                    const ReadOptions& options);

/// "'red', 'white' and 3 more": at most three names.
std::string some_of(const std::vector<std::string>& names);

}  // namespace radbake::gltf
