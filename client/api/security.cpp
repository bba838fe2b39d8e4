#include "client/api/security.h"

#include <fstream>
#include <iterator>

namespace radbake::api {
namespace {

/// This machine: a token does not leave it.
bool is_local(const std::string& address) {
  for (const char* start : {"unix:", "127.", "localhost", "[::1]", "::1"}) {
    if (address.rfind(start, 0) != 0) continue;
    // localhost.example.org is elsewhere.
    if (std::string(start) != "localhost") return true;
    return address.size() == 9 || address[9] == ':';
  }
  return false;
}

Result<std::string> read_pem(const std::filesystem::path& file, const std::string& what) {
  if (file.empty()) return std::string();
  std::ifstream stream(file, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(stream), {});
  if (!stream.good() && text.empty()) {
    return Error{ErrorCode::kNotFound, what + " " + file.string() + " cannot be read, or is empty"};
  }
  if (text.find("-----BEGIN ") == std::string::npos) {
    return invalid_argument(what + " " + file.string() + " is not in PEM (-----BEGIN ...)");
  }
  return text;
}

}  // namespace

Result<std::shared_ptr<grpc::ChannelCredentials>> make_credentials(const std::string& address,
                                                                   const ClientSecurity& security) {
  if (security.certificate.empty() != security.key.empty()) {
    return invalid_argument("--tls-cert and --tls-key go together: the client's certificate and its key");
  }
  if (security.ca.empty()) {
    if (!security.certificate.empty()) {
      return invalid_argument("--tls-cert " + security.certificate.string() +
                              " needs --tls-ca: the authorities that signed the server's certificate");
    }
    if (!security.token.empty() && !is_local(address)) {
      return invalid_argument("a token is not sent to " + address +
                              " without TLS, where others could read it: --tls-ca");
    }
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions tls;
  RADBAKE_ASSIGN_OR_RETURN(tls.pem_root_certs, read_pem(security.ca, "--tls-ca"));
  RADBAKE_ASSIGN_OR_RETURN(tls.pem_cert_chain, read_pem(security.certificate, "--tls-cert"));
  RADBAKE_ASSIGN_OR_RETURN(tls.pem_private_key, read_pem(security.key, "--tls-key"));
  return grpc::SslCredentials(tls);
}

}  // namespace radbake::api
