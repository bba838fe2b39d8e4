#include "client/api/security.h"

#include <arpa/inet.h>

#include <cstdint>
#include <fstream>
#include <sstream>
#include <utility>

namespace radbake::api {
namespace {

/// The host of HOST:PORT, HOST, [ADDRESS]:PORT, [ADDRESS] or a bare IPv6 address; of anything else, anything.
std::string host_of(const std::string& address) {
  if (address.starts_with('[')) {
    const std::size_t end = address.find(']');
    const bool ends_well = end != std::string::npos && (end + 1 == address.size() || address[end + 1] == ':');
    return ends_well ? address.substr(1, end - 1) : address;
  }
  const std::size_t colon = address.find(':');
  const bool is_bare_ipv6 = colon != std::string::npos && address.find(':', colon + 1) != std::string::npos;
  return is_bare_ipv6 ? address : address.substr(0, colon);
}

/// This machine: a token does not leave it. Of names localhost alone: others resolve to what they like.
bool is_local(const std::string& address) {
  if (address.starts_with("unix:")) return true;
  const std::string host = host_of(address);
  in_addr v4{};
  in6_addr v6{};
  constexpr std::uint32_t kLoopbackNet = 127;
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
  if (inet_pton(AF_INET6, host.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6);
  return host == "localhost";
}

Result<std::string> read_pem(const std::filesystem::path& file, const std::string& what) {
  if (file.empty()) return std::string();
  // A stream reads a folder, too, but throws.
  std::error_code failure;
  if (std::filesystem::is_directory(file, failure)) {
    return invalid_argument(what + " " + file.string() + " is a folder, not a file");
  }
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    return Error{ErrorCode::kNotFound, what + " " + file.string() + " cannot be read, or is empty"};
  }
  if (text.view().find("-----BEGIN ") == std::string::npos) {
    return invalid_argument(what + " " + file.string() + " is not in PEM (-----BEGIN ...)");
  }
  return std::move(text).str();
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
