#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "server/access/tls_files.h"

namespace radbake::access {

/// Who may call, and over what. Nothing given: everybody who can connect, as an admin without a tenant.
struct AccessOptions {
  TlsFiles tls;
  std::filesystem::path tokens;         ///< empty: none
  bool allows_insecure_listen = false;  ///< elsewhere than on this machine without TLS: a proxy in front has it

  bool has_tls() const { return !tls.certificate.empty() || !tls.key.empty(); }
  /// Callers have to prove who they are.
  bool knows_callers() const { return !tls.client_ca.empty() || !tokens.empty(); }
};

/// Checks that the options go together, and that an address that others can reach has TLS and knows its callers.
///
/// Errors: kInvalidArgument, with the option, its value and what was expected.
Result<void> check_access(const AccessOptions& options, const std::string& listen, bool is_local);

}  // namespace radbake::access
