#pragma once

#include <filesystem>
#include <string>

#include "client/api/client.h"
#include "common/base/result.h"

namespace CLI {
class App;
}

namespace radbake::cli {

/// What the command line says of TLS and tokens.
struct SecurityChoices {
  std::filesystem::path ca, certificate, key;
  std::filesystem::path token_file;
};

/// Declares --tls-ca, --tls-cert, --tls-key and --token-file.
void add_security_options(CLI::App& app, SecurityChoices& choices);

/// The choices, and where they are silent RADBAKE_TLS_CA, RADBAKE_TLS_CERT, RADBAKE_TLS_KEY and RADBAKE_TOKEN; the
/// token read. Errors: kInvalidArgument for a token file that cannot be read or holds no token.
Result<api::ClientSecurity> read_security(const SecurityChoices& choices);

}  // namespace radbake::cli
