#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <utility>

#include "common/base/result.h"

namespace radbake::options {

/// What a parser made of an option's text; CLI11's exception, which never leaves parse_command_line(), says what is
/// wrong with it.
template <typename T>
T value_or_throw(const char* option, Result<T> parsed) {
  if (!parsed.ok()) throw CLI::ValidationError(option, parsed.error().message);
  return std::move(parsed).value();
}

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
