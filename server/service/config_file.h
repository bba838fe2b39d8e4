#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace radbake::service {

/// The configuration file: one key=value a line, # begins a comment. Stricter than CLI11's own reader: what is not
/// understood is refused with its line, and nothing is passed over.
///
/// Errors: CLI::ConfigError that names file, line, key and what was expected: an unknown key, a key that stands there
/// twice, a line without '=', a section.
class ConfigFile : public CLI::Config {
 public:
  explicit ConfigFile(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
  /// The effective configuration with each option's description, in the format that from_config() reads.
  std::string to_config(const CLI::App* app, bool default_also, bool write_description,
                        std::string prefix) const override;

  /// " (line 7 of the configuration file)" for a key whose value comes from there; else empty.
  std::string place_of(const std::string& key) const;

 private:
  const CLI::App& app_;
  mutable std::map<std::string, int> lines_;  // of the keys that the command line leaves to the file
};

/// The key of an option, which is its first long name; empty for one that no file may set.
std::string key_of(const CLI::Option& option);

}  // namespace radbake::service
