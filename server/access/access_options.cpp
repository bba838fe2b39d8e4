#include "server/access/access_options.h"

namespace radbake::access {

Result<void> check_access(const AccessOptions& options, const std::string& listen, bool is_local) {
  const TlsFiles& tls = options.tls;
  if (tls.certificate.empty() != tls.key.empty()) {
    return invalid_argument(tls.key.empty() ? "--tls-cert " + tls.certificate.string() + " needs --tls-key"
                                            : "--tls-key " + tls.key.string() + " needs --tls-cert");
  }
  if (!tls.client_ca.empty() && !options.has_tls()) {
    return invalid_argument("--tls-client-ca " + tls.client_ca.string() + " needs --tls-cert and --tls-key");
  }
  if (is_local || options.allows_insecure_listen) return {};
  const std::string where = "--listen " + listen + " can be reached from other machines: it ";
  if (!options.has_tls()) {
    return invalid_argument(where +
                            "needs --tls-cert and --tls-key, with --tls-client-ca or --tokens; or --insecure-listen "
                            "where a proxy in front of it encrypts and knows the callers");
  }
  if (!options.knows_callers()) {
    return invalid_argument(where + "needs --tls-client-ca or --tokens, to know who calls");
  }
  return {};
}

}  // namespace radbake::access
