#include "client/cli/security_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "client/cli/help_texts.h"

namespace radbake::cli {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::filesystem::path chosen(const std::filesystem::path& choice, const char* variable) {
  return choice.empty() ? std::filesystem::path(environment(variable)) : choice;
}

/// What a header may carry: visible ASCII, no blanks.
bool is_token(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

void add_security_options(CLI::App& app, SecurityChoices& choices) {
  app.add_option("--tls-ca", choices.ca, kCaHelp)->type_name("FILE");
  app.add_option("--tls-cert", choices.certificate, kCertificateHelp)->type_name("FILE");
  app.add_option("--tls-key", choices.key, kKeyHelp)->type_name("FILE");
  app.add_option("--token-file", choices.token_file, kTokenHelp)->type_name("FILE");
}

Result<api::ClientSecurity> read_security(const SecurityChoices& choices) {
  api::ClientSecurity security;
  security.ca = chosen(choices.ca, "RADBAKE_TLS_CA");
  security.certificate = chosen(choices.certificate, "RADBAKE_TLS_CERT");
  security.key = chosen(choices.key, "RADBAKE_TLS_KEY");
  if (choices.token_file.empty()) {
    security.token = environment("RADBAKE_TOKEN");
    if (security.token.empty() || is_token(security.token)) return security;
    return invalid_argument("RADBAKE_TOKEN is not a token: visible ASCII characters without blanks");
  }
  std::ifstream file(choices.token_file);
  // A folder opens, but has no lines.
  if (!file || !std::getline(file, security.token)) {
    return invalid_argument("--token-file " + choices.token_file.string() + " cannot be read, or is empty");
  }
  if (is_token(security.token)) return security;
  return invalid_argument("--token-file " + choices.token_file.string() +
                          ": its first line is not a token: visible ASCII characters without blanks");
}

}  // namespace radbake::cli
