#include "server/service/config_file.h"

#include <algorithm>
#include <istream>
#include <sstream>

namespace radbake::service {
namespace {

constexpr std::size_t kMaxQuotedBytes = 60;
constexpr std::size_t kCommentWidth = 110;

std::string trimmed(const std::string& text) {
  constexpr const char* kSpace = " \t\r";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

std::string in_quotes(const std::string& text) { return "'" + text.substr(0, kMaxQuotedBytes) + "'"; }

/// Options that are there or not take true or false in a file.
bool is_flag(const CLI::Option& option) { return option.get_expected_min() == 0; }

/// The option of a key as people write it: max_rays is max-rays.
const CLI::Option* find_option(const CLI::App& app, std::string key) {
  std::replace(key.begin(), key.end(), '_', '-');
  const CLI::Option* option = app.get_option_no_throw("--" + key);
  return option != nullptr && option->get_configurable() ? option : nullptr;
}

/// Writes text as comment lines of a bounded width.
void write_comment(std::ostream& out, const std::string& text) {
  std::istringstream words(text);
  std::string word, line = "#";
  while (words >> word) {
    if (line.size() + 1 + word.size() > kCommentWidth) {
      out << line << "\n";
      line = "#";
    }
    line += " " + word;
  }
  out << line << "\n";
}

}  // namespace

std::string key_of(const CLI::Option& option) {
  return option.get_configurable() && !option.get_lnames().empty() ? option.get_lnames().front() : "";
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  std::vector<CLI::ConfigItem> items;
  std::map<std::string, int> seen;
  std::string line;
  for (int number = 1; std::getline(input, line); ++number) {
    const auto refuse = [&](const std::string& problem) {
      throw CLI::ConfigError("line " + std::to_string(number) + " of the configuration file: " + problem);
    };
    line = trimmed(line);
    if (line.empty() || line.front() == '#' || line.front() == ';') continue;
    const std::size_t sign = line.find('=');
    if (line.front() == '[') refuse(in_quotes(line) + " is a section: expected key=value, there are no sections");
    if (sign == std::string::npos) refuse(in_quotes(line) + " has no '=': expected key=value");
    const std::string written = trimmed(line.substr(0, sign)), value = trimmed(line.substr(sign + 1));
    const CLI::Option* option = find_option(app_, written);
    if (option == nullptr) {
      refuse(in_quotes(written) + " with the value " + in_quotes(value) +
             " is unknown: expected one of the keys that radbaked --print-config lists");
    }
    const std::string key = key_of(*option);
    const auto [earlier, is_new] = seen.emplace(key, number);
    if (!is_new) {
      refuse(key + " with the value " + in_quotes(value) + " stands on line " + std::to_string(earlier->second) +
             " already: expected it once");
    }
    if (is_flag(*option) && value != "true" && value != "false") {
      refuse(key + " is " + in_quotes(value) + ": expected true or false");
    }
    if (option->count() > 0) continue;  // the command line wins
    lines_[key] = number;
    CLI::ConfigItem item;
    item.name = key;
    item.inputs = {value};
    items.push_back(item);
  }
  return items;
}

std::string ConfigFile::to_config(const CLI::App* app, bool, bool write_description, std::string) const {
  std::ostringstream out;
  for (const CLI::Option* option : app->get_options()) {
    const std::string key = key_of(*option);
    if (key.empty()) continue;
    if (write_description) write_comment(out, option->get_description());
    std::string value = option->get_default_str();
    if (option->count() > 0) value = option->results().back();
    if (is_flag(*option) && value.empty()) value = "false";
    // An empty value is none: the key would be refused.
    out << (value.empty() ? "# " : "") << key << "=" << value << "\n" << (write_description ? "\n" : "");
  }
  return out.str();
}

std::string ConfigFile::place_of(const std::string& key) const {
  const auto found = lines_.find(key);
  return found == lines_.end() ? "" : " (line " + std::to_string(found->second) + " of the configuration file)";
}

}  // namespace radbake::service
