#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace radbake::options {

/// The value of a word; CLI11's exception, which never leaves parse_command_line(), names the words that there are.
template <typename T>
T word_or_throw(const char* option, const std::map<std::string, T>& words, const std::string& text) {
  const auto it = words.find(text);
  if (it != words.end()) return it->second;
  std::string known;
  for (const auto& [word, value] : words) known += (known.empty() ? "" : ", ") + word;
  throw CLI::ValidationError(option, "'" + text + "' is none of " + known);
}

}  // namespace radbake::options
