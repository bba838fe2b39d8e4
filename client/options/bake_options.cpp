#include "client/options/bake_options.h"

#include <cerrno>
#include <cstdlib>
#include <map>
#include <string>

#include "client/options/effect_options.h"
#include "client/options/target_options.h"
#include "client/options/values.h"
#include "client/options/words.h"

namespace radbake::options {
namespace {

constexpr std::uint32_t kMinAtlasSize = 64, kMaxAtlasSize = 4096;
constexpr double kMinDensity = 1e-3, kMaxDensity = 1e5;
constexpr double kDefaultAoDistance = 1;  // metres, the server's
const std::map<std::string, v1::LightmapUv> kLightmapUvs = {
    {"auto", v1::LIGHTMAP_UV_AUTO}, {"keep", v1::LIGHTMAP_UV_KEEP}, {"unwrap", v1::LIGHTMAP_UV_UNWRAP}};
const std::map<std::string, v1::Output> kOutputs = {
    {"lightmap", v1::OUTPUT_LIGHTMAP}, {"vertices", v1::OUTPUT_VERTICES}, {"both", v1::OUTPUT_BOTH}};
const std::map<std::string, v1::FormFactors> kFormFactors = {{"auto", v1::FORM_FACTORS_AUTO},
                                                             {"analytic", v1::FORM_FACTORS_ANALYTIC},
                                                             {"hemicube", v1::FORM_FACTORS_HEMICUBE},
                                                             {"hemisphere", v1::FORM_FACTORS_HEMISPHERE},
                                                             {"adaptive", v1::FORM_FACTORS_ADAPTIVE}};
const std::map<std::string, v1::Transport> kTransports = {{"auto", v1::TRANSPORT_AUTO},
                                                          {"dense", v1::TRANSPORT_DENSE},
                                                          {"sparse", v1::TRANSPORT_SPARSE},
                                                          {"streamed", v1::TRANSPORT_STREAMED}};
const std::map<std::string, v1::Solver> kSolvers = {
    {"auto", v1::SOLVER_AUTO},           {"lu", v1::SOLVER_LU},
    {"jacobi", v1::SOLVER_JACOBI},       {"gauss-seidel", v1::SOLVER_GAUSS_SEIDEL},
    {"southwell", v1::SOLVER_SOUTHWELL}, {"shooting", v1::SOLVER_SHOOTING},
    {"krylov", v1::SOLVER_KRYLOV}};

bool is_all_digits(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

std::string check_positive(const std::string& text) {
  const unsigned long long value = std::strtoull(text.c_str(), nullptr, 10);
  if (is_all_digits(text) && value >= 1 && value <= UINT32_MAX) return "";
  return "'" + text + "' is not a whole number from 1 to " + std::to_string(UINT32_MAX);
}

std::string check_atlas_size(const std::string& text) {
  const unsigned long size = std::strtoul(text.c_str(), nullptr, 10);
  const bool is_power_of_two = (size & (size - 1)) == 0;
  if (is_all_digits(text) && is_power_of_two && size >= kMinAtlasSize && size <= kMaxAtlasSize) return "";
  return "'" + text + "' is not a power of two from " + std::to_string(kMinAtlasSize) + " to " +
         std::to_string(kMaxAtlasSize);
}

// CLI11 takes -1 for the largest unsigned number.
std::string check_seed(const std::string& text) {
  errno = 0;
  std::strtoull(text.c_str(), nullptr, 10);
  if (is_all_digits(text) && errno == 0) return "";
  return "'" + text + "' is not a whole number from 0 to " + std::to_string(UINT64_MAX);
}

std::string check_density(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (!text.empty() && *end == '\0' && value >= kMinDensity && value <= kMaxDensity) return "";
  return "'" + text + "' is not a number from 0.001 to 100000";
}

std::string check_reflectance(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (!text.empty() && *end == '\0' && value >= 0 && value < 1) return "";
  return "'" + text + "' is not a number from 0 to below 1";
}

}  // namespace

void add_bake_options(CLI::App& command, BakeChoices& choices) {
  command
      .add_option_function<std::string>(
          "--output",
          [&choices](const std::string& text) { choices.output = word_or_throw("--output", kOutputs, text); },
          "What receives the light: lightmap (images), vertices (of the meshes, in scene.glb) or both; default: "
          "lightmap")
      ->type_name("WHAT");
  command
      .add_option_function<std::string>(
          "--lightmap-uv",
          [&choices](const std::string& text) {
            choices.lightmap_uv = word_or_throw("--lightmap-uv", kLightmapUvs, text);
          },
          "The lightmap's layout: auto keeps each mesh's own TEXCOORD_1 where it is valid (inside 0..1, no overlap) "
          "and unwraps the others; keep refuses a mesh without a valid one; unwrap makes all anew; default: auto")
      ->type_name("HOW");
  command
      .add_option("--texels-per-meter", choices.texels_per_meter,
                  "Density of the lightmap; an object's own factor on it is radbake_texel_density in the extras of its "
                  "node or mesh; default: 32, or less, with a warning, where the scene is too large for that")
      ->check(check_density, "")
      ->type_name("D");
  command
      .add_option("--atlas-size", choices.atlas_size,
                  "Size of a lightmap's sheet: texels along a side, a power of two from 64 to 4096; where one is "
                  "full, another is begun; default: as small as holds the scene at that density")
      ->check(check_atlas_size, "")
      ->type_name("N");
  command
      .add_option_function<std::string>(
          "--sky", [&choices](const std::string& text) { choices.sky = value_or_throw("--sky", parse_rgb(text)); },
          "Light from a constant sky: luminance in nit, linear Rec.709")
      ->type_name("R,G,B");
  command
      .add_option_function<std::string>(
          "--hdri",
          [&choices](const std::string& text) { choices.sky_image = value_or_throw("--hdri", parse_sky_image(text)); },
          "Light from a sky image: equirectangular .hdr or .exr, +Y up, its values x SCALE in nit, linear Rec.709")
      ->type_name("FILE[:SCALE]")
      ->excludes("--sky");
  command
      .add_option_function<std::string>(
          "--sun", [&choices](const std::string& text) { choices.sun = value_or_throw("--sun", parse_sun(text)); },
          "Light from a sun: the direction in which it travels (glTF's world, +Y is up), its illuminance in lx on a "
          "facing surface, and its angular diameter: 0.53 where none is given, 0 for hard shadows")
      ->type_name("DX,DY,DZ:R,G,B[:DEGREES]");
  add_effect_options(command, choices);
  add_target_options(command, choices);
  command
      .add_option_function<std::string>(
          "--form-factors",
          [&choices](const std::string& text) {
            choices.form_factors = word_or_throw("--form-factors", kFormFactors, text);
          },
          "Between patches: hemisphere (rays), hemicube (its pixels), adaptive (near pairs by formula, others by rays) "
          "or analytic (all by formula: slow, for reference); texels gather by rays; default: auto, hemisphere")
      ->type_name("METHOD");
  command
      .add_option_function<std::string>(
          "--solver",
          [&choices](const std::string& text) { choices.solver = word_or_throw("--solver", kSolvers, text); },
          "lu, jacobi, gauss-seidel, southwell, shooting or krylov; default: auto, gauss-seidel, or krylov where "
          "surfaces reflect above 0.95 or form factors are streamed")
      ->type_name("METHOD");
  command
      .add_option_function<std::string>(
          "--transport",
          [&choices](const std::string& text) { choices.transport = word_or_throw("--transport", kTransports, text); },
          "How form factors are kept: dense (n x n), sparse, or streamed (one row at a time, traced again for each "
          "use: slow, for scenes that do not fit); default: auto, the fastest that keeps --memory")
      ->type_name("HOW");
  command
      .add_option_function<std::string>(
          "--memory",
          [&choices](const std::string& text) { choices.memory = value_or_throw("--memory", parse_bytes(text)); },
          "Memory that --transport auto may use for form factors; decides a result only where it makes them streamed; "
          "default: 4G")
      ->type_name("N[K|M|G]");
  command
      .add_option("--rays", choices.rays,
                  "Hemisphere rays a texel, whatever error comes of it; a patch's row gets the same; default: the "
                  "server's, 256")
      ->check(check_positive, "")
      ->type_name("N");
  command
      .add_option("--max-patches", choices.max_patches,
                  "Bound on the number of patches, the senders of light; default: the server's, 16384, or 1024 "
                  "with form factors by formula")
      ->check(check_positive, "")
      ->type_name("N");
  command
      .add_option("--max-reflectance", choices.max_reflectance,
                  "Limit on the materials' reflectance, since white surfaces that lose nothing never settle")
      ->check(check_reflectance, "")
      ->capture_default_str()
      ->type_name("R");
  command.add_option("--threads", choices.threads, "Threads of the bake; changes no result; default: all cores")
      ->check(check_positive, "")
      ->type_name("N");
  command.add_option("--seed", choices.seed, "Seed of the random numbers")
      ->check(check_seed, "")
      ->capture_default_str()
      ->type_name("N");
}

v1::BakeSettings to_settings(const BakeChoices& choices) {
  v1::BakeSettings settings;
  settings.set_atlas_size(choices.atlas_size);
  settings.set_rays(choices.rays);
  settings.set_max_patches(choices.max_patches);
  settings.set_seed(choices.seed);
  settings.set_texels_per_meter(choices.texels_per_meter);
  settings.set_lightmap_uv(choices.lightmap_uv);
  settings.set_output(choices.output);
  settings.set_form_factors(choices.form_factors);
  settings.set_solver(choices.solver);
  settings.set_transport(choices.transport);
  settings.set_transport_memory_bytes(choices.memory);
  for (const auto& [name, choice] : choices.effects) {
    if (choice == v1::EFFECT_CHOICE_AUTO) continue;
    v1::EffectOverride& effect = *settings.add_effects();
    effect.set_effect(name);
    effect.set_choice(choice);
  }
  for (const v1::ExtraLayer layer : choices.layers) settings.add_layers(layer);
  if (choices.ao_distance != kDefaultAoDistance) settings.set_ao_distance(choices.ao_distance);
  settings.set_max_error(asked_error(choices));
  settings.set_time_budget_ms(choices.time_budget_ms);
  return settings;
}

v1::RunOptions to_run_options(const BakeChoices& choices) {
  v1::RunOptions run;
  run.set_threads(choices.threads);
  return run;
}

}  // namespace radbake::options
