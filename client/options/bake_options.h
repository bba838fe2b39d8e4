#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "client/options/values.h"
#include "common/scene/scene.h"
#include "radbake/v1/settings.pb.h"

namespace radbake::options {

/// What decides a bake. Zero means: the server's default.
struct BakeChoices {
  std::uint32_t atlas_size = 0;
  double texels_per_meter = 0;
  v1::LightmapUv lightmap_uv = v1::LIGHTMAP_UV_AUTO;
  v1::Output output = v1::OUTPUT_LIGHTMAP;
  v1::FormFactors form_factors = v1::FORM_FACTORS_AUTO;
  v1::Transport transport = v1::TRANSPORT_AUTO;
  std::uint64_t memory = 0;  ///< bytes; what v1::TRANSPORT_AUTO has to keep
  v1::Solver solver = v1::SOLVER_AUTO;
  std::uint32_t rays = 0;
  std::uint32_t max_patches = 0;
  std::uint64_t seed = 0;
  std::uint32_t threads = 0;
  double max_reflectance = 0.98;
  std::optional<Vec3> sky;
  std::optional<SkyImage> sky_image;  ///< never beside a sky
  std::optional<DirectionalLight> sun;
  std::map<std::string, v1::EffectChoice> effects;  ///< by name; others: v1::EFFECT_CHOICE_AUTO
  std::set<v1::ExtraLayer> layers;
  double ao_distance = 0;            ///< metres
  double max_error = 0;              ///< relative RMSE to reach, as a fraction
  std::string quality;               ///< a name of kQualities; never beside max_error
  std::uint64_t time_budget_ms = 0;  ///< from the server's acceptance to the last tile
};

/// Gives a command the options of a bake. `choices` outlives it. Bad values throw CLI11's exception when it parses.
void add_bake_options(CLI::App& command, BakeChoices& choices);

/// The choices as a server takes them, equal bytes for equal choices. The sky, the sun and the limit on reflectance are
/// in the scene by then.
v1::BakeSettings to_settings(const BakeChoices& choices);
v1::RunOptions to_run_options(const BakeChoices& choices);

}  // namespace radbake::options
