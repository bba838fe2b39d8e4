#include "client/cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <map>
#include <sstream>

#include "client/cli/exit_code.h"
#include "client/cli/help_texts.h"
#include "client/cli/security_options.h"
#include "client/options/effect_options.h"
#include "client/options/target_options.h"
#include "client/options/words.h"
#include "common/base/version.h"

namespace radbake::cli {
namespace {

const std::map<std::string, Encoding> kEncodings = {
    {"exr", Encoding::kExr}, {"hdr", Encoding::kHdr}, {"png-rgbm", Encoding::kRgbmPng}};

class Parser {
 public:
  Parser() {
    app_.name("radbake");
    app_.set_version_flag("--version", std::string("radbake ") + kEngineVersion + " (protocol " +
                                           std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor) + ")");
    app_.footer(kMainFooter + std::string(kExitCodes));
    app_.require_subcommand(1);
    add_submit();
    add_plan();
    add_command(Command::kList, "list", "List the server's bakes, newest first", kListFooter);
    add_job(add_command(Command::kWatch, "watch", "Follow a bake to its end", kWatchFooter));
    add_job(add_command(Command::kFinish, "finish", "Ask a bake to end with the best that it has", kFinishFooter));
    add_job(add_command(Command::kCancel, "cancel", "Ask a bake to stop", kCancelFooter));
    CLI::App* download =
        add_command(Command::kDownload, "download", "Write a bake's results to a folder", kDownloadFooter);
    add_job(download);
    add_folder(download, true);
    add_files(download);
    download->add_option("--scene", line_.scene, "The .glb or .gltf file that was baked: writes scene.glb as well")
        ->type_name("SCENE");
    add_command(Command::kCapabilities, "capabilities", "Say what a server can do, and its limits",
                kCapabilitiesFooter);
    add_compare();
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
    if (line_.server.empty() && line_.command != Command::kSubmit && line_.command != Command::kPlan &&
        line_.command != Command::kCapabilities && line_.command != Command::kCompare) {
      return EarlyExit{kUsage, "",
                       "radbake " + app_.get_subcommands().front()->get_name() +
                           " needs a server: --server HOST:PORT or unix:PATH, or RADBAKE_SERVER\n"};
    }
    if (line_.command == Command::kSubmit && line_.folder.empty() && !line_.dry_run && !line_.detach) {
      return EarlyExit{kUsage, "", "--out is required: the folder for the results, or --dry-run, or --detach\n"};
    }
    if (line_.detach && line_.server.empty()) {
      return EarlyExit{kUsage, "", "--detach needs a server that stays: --server HOST:PORT or unix:PATH\n"};
    }
    if (line_.detach && (line_.strict || !line_.folder.empty())) {
      return EarlyExit{kUsage, "", "--detach waits for no result: without --out and --strict\n"};
    }
    if (line_.command == Command::kSubmit && line_.files.vertex_colors && line_.bake.output == v1::OUTPUT_LIGHTMAP) {
      return EarlyExit{kUsage, "", "--vertex-colors needs light by vertex: --output vertices or --output both\n"};
    }
    if (const std::string problem = options::find_contradiction(line_.bake); !problem.empty()) {
      return EarlyExit{kUsage, "", problem + "\n"};
    }
    if (line_.strict && options::asked_error(line_.bake) == 0) {
      return EarlyExit{kUsage, "", "--strict needs an error to reach: --max-error or --quality\n"};
    }
    // A private server asks nobody who he is.
    if (!line_.server.empty()) {
      Result<api::ClientSecurity> security = read_security(security_);
      if (!security.ok()) return EarlyExit{kUsage, "", security.error().message + "\n"};
      line_.security = std::move(security).value();
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
    add_security_options(*sub, security_);
    sub->add_flag("--json", line_.json,
                  command == Command::kSubmit || command == Command::kWatch ? "Print one JSON event a line on stdout"
                                                                            : "Print one JSON object on stdout");
    sub->callback([this, command] { line_.command = command; });
    return sub;
  }

  void add_job(CLI::App* sub) {
    sub->add_option("JOB", line_.job, "The bake's name, as submit prints it")->required()->type_name("");
  }

  void add_folder(CLI::App* sub, bool is_required) {
    sub->add_option("-o,--out", line_.folder, "Folder for the results; is made where there is none")
        ->required(is_required)
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
      const Encoding encoding = options::word_or_throw("--encoding", kEncodings, word);
      const bool is_new = std::find(encodings.begin(), encodings.end(), encoding) == encodings.end();
      if (is_new) encodings.push_back(encoding);
    }
    return encodings;
  }

  void add_submit() {
    CLI::App* sub = add_command(Command::kSubmit, "submit", "Bake a glTF scene", kSubmitFooter);
    sub->add_option("SCENE", line_.scene, "A .glb or .gltf file")->required()->type_name("");
    add_folder(sub, false);
    sub->add_flag("--dry-run", line_.dry_run,
                  "Check all that a submit checks and print the plan, as radbake plan does; bakes and writes nothing");
    options::add_bake_options(*sub, line_.bake);
    sub->add_flag(
        "--detach", line_.detach,
        "Leave once the server has accepted the bake: radbake watch and radbake download find it by its name");
    sub->add_option("--priority", line_.priority, "Where the server has a queue: higher starts earlier")
        ->check(CLI::Range(-100, 100))
        ->capture_default_str()
        ->type_name("N");
    sub->add_flag("--no-cache", line_.no_cache,
                  "Bake it, also where the server has the result of an equal bake or runs one");
    sub->add_flag("--strict", line_.strict,
                  "Exit with 7 where the error asked for was not reached; all files are written all the same");
    add_files(sub);
  }

  void add_plan() {
    CLI::App* sub =
        add_command(Command::kPlan, "plan",
                    "Say what a bake would simulate and why, how long it takes and what it needs", kPlanFooter);
    sub->add_option("SCENE", line_.scene, "A .glb or .gltf file")->required()->type_name("");
    options::add_bake_options(*sub, line_.bake);
    sub->add_option("--deadline", line_.plan_seconds, "Seconds to wait for the plan")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str()
        ->type_name("S");
  }

  // The one command without a server.
  void add_compare() {
    CLI::App* sub = app_.add_subcommand("compare", "Say how far a lightmap is from a reference, and draw where");
    sub->footer(kCompareFooter + std::string(kExitCodes));
    sub->callback([this] { line_.command = Command::kCompare; });
    CompareChoices& choices = line_.compare;
    sub->add_option("REFERENCE", choices.reference, "EXR that is taken for the truth")->required()->type_name("");
    sub->add_option("MAP", choices.map, "EXR of the same size that is compared with it")->required()->type_name("");
    sub->add_option("--scale", choices.scale, "Factor on MAP: 0.31830988618 where REFERENCE is irradiance / pi")
        ->check(check_scale, "")
        ->capture_default_str()
        ->type_name("S");
    sub->add_option("--mask", choices.mask, "EXR or PNG of the same size: only texels whose first channel is above 0")
        ->type_name("FILE");
    sub->add_flag(
        "--edges", choices.with_edges,
        "Also texels at borders of charts, emitters and footprints, where bakers differ in what they average");
    CLI::Option* error =
        sub->add_option("--error", choices.error,
                        "EXR of MAP's standard errors, error_N.exr of a bake: also says how well they hold")
            ->type_name("FILE");
    sub->add_option("--reference-error", choices.reference_error, "EXR of REFERENCE's own standard errors")
        ->needs(error)
        ->type_name("FILE");
    sub->add_option("-o,--out", choices.picture, "Picture of the differences: PNG")->type_name("FILE");
    sub->add_flag("--json", line_.json, "Print one JSON object on stdout");
  }

  static std::string check_scale(const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool is_number = !text.empty() && *end == '\0' && value > 0 && value <= std::numeric_limits<double>::max();
    return is_number ? "" : "'" + text + "' is not a number above 0";
  }

  CommandLine line_;
  SecurityChoices security_;
  CLI::App app_{"Bakes global illumination into lightmaps: diffuse light, by radiosity"};
};

}  // namespace

std::variant<CommandLine, EarlyExit> parse_command_line(const std::vector<std::string>& arguments) {
  return Parser().parse(arguments);
}

}  // namespace radbake::cli
