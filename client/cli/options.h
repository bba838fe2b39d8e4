#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "client/api/client.h"
#include "client/options/bake_options.h"

namespace radbake::cli {

enum class Command { kSubmit, kPlan, kList, kWatch, kFinish, kCancel, kDownload, kCapabilities, kCompare };

using options::BakeChoices;

/// A kind of image file.
enum class Encoding { kExr, kHdr, kRgbmPng };

/// Which files are written.
struct FileChoices {
  std::vector<Encoding> encodings = {Encoding::kExr};  ///< of the lightmaps, each once
  bool vertex_colors = false;                          ///< light by vertex as COLOR_0 too
};

/// Which lightmaps are compared, and how. Empty: not given.
struct CompareChoices {
  std::filesystem::path reference, map;
  std::filesystem::path mask;
  std::filesystem::path error, reference_error;  ///< standard errors of each
  std::filesystem::path picture;
  bool with_edges = false;
  double scale = 1;  ///< of the map
};

/// A valid command line.
struct CommandLine {
  Command command = Command::kCapabilities;
  std::string server;            ///< empty: a private one
  api::ClientSecurity security;  ///< of the server that is named
  bool json = false;
  std::filesystem::path scene;   ///< submit, plan; download: empty where it is not given
  BakeChoices bake;              ///< submit, plan
  std::string job;               ///< watch, finish, cancel, download: bakes/ID
  std::filesystem::path folder;  ///< submit, download
  bool force = false;            ///< submit, download
  FileChoices files;             ///< submit, download
  bool dry_run = false;          ///< submit
  bool detach = false;           ///< submit: leave once the bake is accepted
  bool no_cache = false;         ///< submit: run it, whatever the server has of it
  int priority = 0;              ///< submit
  bool strict = false;           ///< submit: an error that is not reached is an exit code of its own
  double plan_seconds = 60;      ///< plan: how long to wait for the answer
  CompareChoices compare;        ///< compare

  /// Nothing is baked and nothing written.
  bool only_plans() const { return command == Command::kPlan || dry_run; }
};

/// The program is to print this and end: help, version, or what is wrong with the command line.
struct EarlyExit {
  int code = 0;
  std::string out;
  std::string err;
};

/// Reads the command line and RADBAKE_SERVER. Errors: an EarlyExit with code 2 whose text names the option and value.
std::variant<CommandLine, EarlyExit> parse_command_line(const std::vector<std::string>& arguments);

}  // namespace radbake::cli
