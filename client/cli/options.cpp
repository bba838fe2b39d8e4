#include "client/cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <sstream>

#include "client/cli/exit_code.h"
#include "client/cli/help_texts.h"
#include "client/cli/values.h"
#include "common/base/version.h"

namespace radbake::cli {
namespace {

constexpr std::uint32_t kMinAtlasSize = 64, kMaxAtlasSize = 4096;
constexpr double kMinDensity = 1e-3, kMaxDensity = 1e5;
const std::map<std::string, v1::LightmapUv> kLightmapUvs = {
    {"auto", v1::LIGHTMAP_UV_AUTO}, {"keep", v1::LIGHTMAP_UV_KEEP}, {"unwrap", v1::LIGHTMAP_UV_UNWRAP}};
const std::map<std::string, v1::Output> kOutputs = {
    {"lightmap", v1::OUTPUT_LIGHTMAP}, {"vertices", v1::OUTPUT_VERTICES}, {"both", v1::OUTPUT_BOTH}};
const std::map<std::string, Encoding> kEncodings = {
    {"exr", Encoding::kExr}, {"hdr", Encoding::kHdr}, {"png-rgbm", Encoding::kRgbmPng}};

/// The value of a parser, or CLI11's exception, which never leaves this file.
template <typename T>
T value_or_throw(const char* option, Result<T> parsed) {
  if (!parsed.ok()) throw CLI::ValidationError(option, parsed.error().message);
  return std::move(parsed).value();
}

/// The value of a word; CLI11's exception names the words that there are.
template <typename T>
T word_or_throw(const char* option, const std::map<std::string, T>& words, const std::string& text) {
  const auto it = words.find(text);
  if (it != words.end()) return it->second;
  std::string known;
  for (const auto& [word, value] : words) known += (known.empty() ? "" : ", ") + word;
  throw CLI::ValidationError(option, "'" + text + "' is none of " + known);
}

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

class Parser {
 public:
  Parser() {
    app_.name("radbake");
    app_.set_version_flag("--version", std::string("radbake ") + kEngineVersion + " (protocol " +
                                           std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor) + ")");
    app_.footer(kMainFooter + std::string(kExitCodes));
    app_.require_subcommand(1);
    add_submit();
    add_command(Command::kList, "list", "List the server's bakes, newest first", kListFooter);
    add_job(add_command(Command::kWatch, "watch", "Follow a bake to its end", kWatchFooter));
    add_job(add_command(Command::kCancel, "cancel", "Ask a bake to stop", kCancelFooter));
    CLI::App* download =
        add_command(Command::kDownload, "download", "Write a bake's results to a folder", kDownloadFooter);
    add_job(download);
    add_folder(download);
    add_files(download);
    download->add_option("--scene", line_.scene, "The .glb or .gltf file that was baked: writes scene.glb as well")
        ->type_name("SCENE");
    add_command(Command::kCapabilities, "capabilities", "Say what a server can do, and its limits",
                kCapabilitiesFooter);
  }

  std::variant<CommandLine, EarlyExit> parse(const std::vector<std::string>& arguments) {
    try {
      // CLI11 takes the words from the back.
      app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& reason) {
      std::ostringstream out, err;
      const int code = app_.exit(reason, out, err);
      return EarlyExit{code == 0 ? kDone : kUsage, out.str(), err.str()};
    }
    // Not by CLI11's envname: it sets the options of all commands, also of those that were not given.
    const char* server = std::getenv("RADBAKE_SERVER");
    if (line_.server.empty() && server != nullptr) line_.server = server;
    if (line_.server.empty() && line_.command != Command::kSubmit && line_.command != Command::kCapabilities) {
      return EarlyExit{kUsage, "",
                       "radbake " + app_.get_subcommands().front()->get_name() +
                           " needs a server: --server HOST:PORT or unix:PATH, or RADBAKE_SERVER\n"};
    }
    if (line_.command == Command::kSubmit && line_.files.vertex_colors && line_.bake.output == v1::OUTPUT_LIGHTMAP) {
      return EarlyExit{kUsage, "", "--vertex-colors needs light by vertex: --output vertices or --output both\n"};
    }
    // Both the name that submit prints and the bare id name a job.
    if (!line_.job.empty() && line_.job.rfind("bakes/", 0) != 0) line_.job = "bakes/" + line_.job;
    return line_;
  }

 private:
  CLI::App* add_command(Command command, const std::string& name, const std::string& description,
                        const std::string& footer) {
    CLI::App* sub = app_.add_subcommand(name, description);
    sub->footer(footer + kExitCodes);
    sub->add_option("--server", line_.server, kServerHelp)->type_name("ADDRESS");
    sub->add_flag("--json", line_.json,
                  command == Command::kSubmit || command == Command::kWatch ? "Print one JSON event a line on stdout"
                                                                            : "Print one JSON object on stdout");
    sub->callback([this, command] { line_.command = command; });
    return sub;
  }

  void add_job(CLI::App* sub) {
    sub->add_option("JOB", line_.job, "The bake's name, as submit prints it")->required()->type_name("");
  }

  void add_folder(CLI::App* sub) {
    sub->add_option("-o,--out", line_.folder, "Folder for the results; is made where there is none")
        ->required()
        ->type_name("DIR");
    sub->add_flag("--force", line_.force, "Write to DIR even if it is not empty");
  }

  void add_files(CLI::App* sub) {
    sub->add_option_function<std::string>(
           "--encoding", [this](const std::string& text) { line_.files.encodings = parse_encodings(text); },
           "Files of each lightmap, one or more of exr (float32, exact), hdr (Radiance), png-rgbm (8 bits, linear "
           "RGBM; the multiplier is in lightmaps.json); default: exr. The picture inside scene.glb is apart from these")
        ->type_name("LIST");
    sub->add_flag("--vertex-colors", line_.files.vertex_colors,
                  "With light by vertex: write it as COLOR_0 too, over the scene's maximum; colours that are there "
                  "multiply it and stay as _COLOR_0_SOURCE");
  }

  static std::vector<Encoding> parse_encodings(const std::string& text) {
    std::vector<Encoding> encodings;
    std::istringstream words(text + ",");
    for (std::string word; std::getline(words, word, ',');) {
      const Encoding encoding = word_or_throw("--encoding", kEncodings, word);
      const bool is_new = std::find(encodings.begin(), encodings.end(), encoding) == encodings.end();
      if (is_new) encodings.push_back(encoding);
    }
    return encodings;
  }

  void add_submit() {
    CLI::App* sub = add_command(Command::kSubmit, "submit", "Bake a glTF scene", kSubmitFooter);
    BakeChoices& bake = line_.bake;
    sub->add_option("SCENE", line_.scene, "A .glb or .gltf file")->required()->type_name("");
    add_folder(sub);
    sub->add_option_function<std::string>(
           "--output", [&bake](const std::string& text) { bake.output = word_or_throw("--output", kOutputs, text); },
           "What receives the light: lightmap (images), vertices (of the meshes, in scene.glb) or both; default: "
           "lightmap")
        ->type_name("WHAT");
    sub->add_option_function<std::string>(
           "--lightmap-uv",
           [&bake](const std::string& text) { bake.lightmap_uv = word_or_throw("--lightmap-uv", kLightmapUvs, text); },
           "The lightmap's layout: auto keeps each mesh's own TEXCOORD_1 where it is valid (inside 0..1, no overlap) "
           "and unwraps the others; keep refuses a mesh without a valid one; unwrap makes all anew; default: auto")
        ->type_name("HOW");
    sub->add_option(
           "--texels-per-meter", bake.texels_per_meter,
           "Density of the lightmap; an object's own factor on it is radbake_texel_density in the extras of its "
           "node or mesh; default: 32, or less, with a warning, where the scene is too large for that")
        ->check(check_density, "")
        ->type_name("D");
    sub->add_option("--atlas-size", bake.atlas_size,
                    "Size of a lightmap's sheet: texels along a side, a power of two from 64 to 4096; where one is "
                    "full, another is begun; default: as small as holds the scene at that density")
        ->check(check_atlas_size, "")
        ->type_name("N");
    add_files(sub);
    sub->add_option_function<std::string>(
           "--sky", [&bake](const std::string& text) { bake.sky = value_or_throw("--sky", parse_rgb(text)); },
           "Light from a constant sky: luminance in nit, linear Rec.709")
        ->type_name("R,G,B");
    sub->add_option_function<std::string>(
           "--sun", [&bake](const std::string& text) { bake.sun = value_or_throw("--sun", parse_sun(text)); },
           "Light from a sun: the direction in which it travels (glTF's world, +Y is up) and its illuminance in lx on "
           "a facing surface")
        ->type_name("DX,DY,DZ:R,G,B");
    sub->add_option("--rays", bake.rays,
                    "Hemisphere rays a texel; a patch's row gets the same; default: the server's, 256")
        ->check(check_positive, "")
        ->type_name("N");
    sub->add_option("--max-patches", bake.max_patches,
                    "Bound on the number of patches, the senders of light; default: the server's, 16384")
        ->check(check_positive, "")
        ->type_name("N");
    sub->add_option("--max-reflectance", bake.max_reflectance,
                    "Limit on the materials' reflectance, since white surfaces that lose nothing never settle")
        ->check(check_reflectance, "")
        ->capture_default_str()
        ->type_name("R");
    sub->add_option("--threads", bake.threads, "Threads of the bake; changes no result; default: all cores")
        ->check(check_positive, "")
        ->type_name("N");
    sub->add_option("--seed", bake.seed, "Seed of the random numbers")
        ->check(check_seed, "")
        ->capture_default_str()
        ->type_name("N");
  }

  CommandLine line_;
  CLI::App app_{"Bakes global illumination into lightmaps: diffuse light, by radiosity"};
};

}  // namespace

std::variant<CommandLine, EarlyExit> parse_command_line(const std::vector<std::string>& arguments) {
  return Parser().parse(arguments);
}

}  // namespace radbake::cli
