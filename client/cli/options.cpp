#include "client/cli/options.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdlib>
#include <sstream>

#include "client/cli/exit_code.h"
#include "client/cli/values.h"
#include "common/base/version.h"

namespace radbake::cli {
namespace {

constexpr std::uint32_t kMinAtlasSize = 64, kMaxAtlasSize = 4096;
constexpr char kServerHelp[] = "HOST:PORT or unix:PATH of a radbaked (environment: RADBAKE_SERVER)";
constexpr char kExitCodes[] =
    "Exit codes: 0 done, 2 usage, 3 bad scene, 4 server unreachable, 5 bake failed, 6 cancelled, 130 left by Ctrl-C.\n";

constexpr char kMainFooter[] =
    "\nExamples:\n"
    "  radbake submit room.glb -o baked/                 bake here, with a private server\n"
    "  radbake submit room.glb -o baked/ --server bakery:7419\n"
    "  radbake submit --help                             what can be chosen, with more examples\n"
    "  export RADBAKE_SERVER=bakery:7419; radbake list   what the server bakes and has baked\n\n";

constexpr char kSubmitFooter[] =
    "\nWrites to DIR, when all is done: lightmap_0.exr (irradiance in lx, linear Rec.709, float32; alpha is "
    "coverage),\n"
    "lightmap_0.png (an exposed preview) and report.json. The first line on stdout is the job's name.\n"
    "Ctrl-C cancels the job.\n"
    "\nExamples:\n"
    "  radbake submit room.glb -o baked/\n"
    "      the atlas is the smallest power of two that gives 32 texels a metre\n"
    "  radbake submit room.glb -o baked/ --force --atlas-size 512 --rays 256\n"
    "      a quick preview over the results of an earlier bake\n"
    "  radbake submit house.glb -o baked/ --sky 3000,3500,5000 --sun 0.4,-1,0.3:80000,76000,70000\n"
    "      daylight: a blue sky, and a sun that stands high\n"
    "  radbake submit room.glb -o baked/ --json | jq -r 'select(.event == \"progress\") | .progress.fraction'\n"
    "      one event a line, for programs\n\n";

constexpr char kListFooter[] =
    "\nExamples:\n"
    "  radbake list --server bakery:7419\n"
    "  radbake list --json | jq -r '.bakes[] | select(.state == \"FAILED\") | .name'\n\n";

constexpr char kWatchFooter[] =
    "\nCtrl-C leaves; the bake goes on.\n"
    "\nExamples:\n"
    "  radbake watch bakes/3f9c --server bakery:7419\n"
    "  radbake watch bakes/3f9c && radbake download bakes/3f9c -o baked/\n\n";

constexpr char kCancelFooter[] =
    "\nAsks the bake to stop and returns at once; a bake that has ended stays as it is.\n"
    "\nExamples:\n"
    "  radbake cancel bakes/3f9c --server bakery:7419\n\n";

constexpr char kDownloadFooter[] =
    "\nWrites what submit would have written. Results wait on the server for who asks.\n"
    "\nExamples:\n"
    "  radbake download bakes/3f9c -o baked/ --server bakery:7419\n"
    "  radbake download bakes/3f9c -o baked/ --force     over the results of an earlier bake\n\n";

constexpr char kCapabilitiesFooter[] =
    "\nExamples:\n"
    "  radbake capabilities                              of a private server\n"
    "  radbake capabilities --server bakery:7419 --json | jq .limits.max_triangles\n\n";

/// The value of a parser, or CLI11's exception, which never leaves this file.
template <typename T>
T value_or_throw(const char* option, Result<T> parsed) {
  if (!parsed.ok()) throw CLI::ValidationError(option, parsed.error().message);
  return std::move(parsed).value();
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
    add_output(download);
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

  void add_output(CLI::App* sub) {
    sub->add_option("-o,--output", line_.output, "Folder for the results; is made where there is none")
        ->required()
        ->type_name("DIR");
    sub->add_flag("--force", line_.force, "Write to DIR even if it is not empty");
  }

  void add_submit() {
    CLI::App* sub = add_command(Command::kSubmit, "submit", "Bake a glTF scene", kSubmitFooter);
    BakeChoices& bake = line_.bake;
    sub->add_option("SCENE", line_.scene, "A .glb or .gltf file")->required()->type_name("");
    add_output(sub);
    sub->add_option("--atlas-size", bake.atlas_size,
                    "Texels along a side of the lightmap, a power of two from 64 to 4096; default: the smallest that "
                    "gives 32 texels a metre")
        ->check(check_atlas_size, "")
        ->type_name("N");
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
