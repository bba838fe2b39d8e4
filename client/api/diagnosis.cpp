#include "client/api/diagnosis.h"

#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>

namespace radbake::api {
namespace {

/// For connecting, and for each answer of the server.
constexpr timeval kPatience{3, 0};
/// HTTP/2, which gRPC's servers insist on.
constexpr std::array<unsigned char, 3> kProtocols = {2, 'h', '2'};

struct FreeContext {
  void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
};
struct FreeSession {
  void operator()(SSL* session) const { SSL_free(session); }
};
using Context = std::unique_ptr<SSL_CTX, FreeContext>;
using Session = std::unique_ptr<SSL, FreeSession>;

/// A socket that is closed at the end.
struct Socket {
  int fd = -1;
  ~Socket() {
    if (fd >= 0) close(fd);
  }
};

/// Why OpenSSL failed, in its own words.
std::string last_reason() {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return reason == nullptr ? "no reason given" : reason;
}

/// What is wrong with our own files; empty if nothing.
std::string load_files(SSL_CTX* context, const ClientSecurity& security) {
  ERR_clear_error();
  if (SSL_CTX_load_verify_file(context, security.ca.c_str()) != 1) {
    return "--tls-ca " + security.ca.string() + " is not readable: " + last_reason();
  }
  if (security.certificate.empty()) return "";
  if (SSL_CTX_use_certificate_chain_file(context, security.certificate.c_str()) != 1) {
    return "--tls-cert " + security.certificate.string() + " is not readable: " + last_reason();
  }
  if (SSL_CTX_use_PrivateKey_file(context, security.key.c_str(), SSL_FILETYPE_PEM) != 1) {
    return "--tls-key " + security.key.string() + " is not the key of --tls-cert " + security.certificate.string() +
           ": " + last_reason();
  }
  return "";
}

/// Tries each address of the host.
bool connect_to(const std::string& host, const std::string& port, Socket& connected) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) return false;
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, &freeaddrinfo);
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    Socket socket{::socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    // The limit on sending is the limit on connecting too: socket(7).
    setsockopt(socket.fd, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
    setsockopt(socket.fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
    if (connect(socket.fd, one->ai_addr, one->ai_addrlen) != 0) continue;
    std::swap(connected.fd, socket.fd);
    return true;
  }
  return false;
}

/// Asks for a certificate of this host, a name or a number.
void expect_host(SSL* session, const std::string& host) {
  X509_VERIFY_PARAM* expected = SSL_get0_param(session);
  if (X509_VERIFY_PARAM_set1_ip_asc(expected, host.c_str()) == 1) return;
  SSL_set_tlsext_host_name(session, host.c_str());
  X509_VERIFY_PARAM_set1_host(expected, host.c_str(), host.size());
}

/// Why our side ended the handshake.
std::string explain_refusal_of_server(const SSL* session, const std::string& host, const ClientSecurity& security) {
  const long verdict = SSL_get_verify_result(session);
  switch (verdict) {
    case X509_V_OK: break;
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH: return "the server's certificate is not for the name " + host;
    case X509_V_ERR_CERT_HAS_EXPIRED: return "the server's certificate has expired";
    default:
      return "the server's certificate is not trusted by --tls-ca " + security.ca.string() + ": " +
             X509_verify_cert_error_string(verdict);
  }
  if (ERR_GET_REASON(ERR_peek_last_error()) == SSL_R_WRONG_VERSION_NUMBER) {
    return "the server does not speak TLS: leave --tls-ca out";
  }
  return "TLS: " + last_reason();
}

/// Why the server ended what was a handshake for us: in TLS 1.3 it judges our certificate afterwards.
std::string explain_refusal_of_client(const ClientSecurity& security) {
  if (security.certificate.empty()) return "the server asks for a client's certificate: --tls-cert and --tls-key";
  return "the server does not accept --tls-cert " + security.certificate.string() + ": " + last_reason();
}

}  // namespace

std::string diagnose_tls(const std::string& target, const ClientSecurity& security) {
  const std::size_t colon = target.rfind(':');
  if (target.starts_with("unix:") || colon == std::string::npos) return "";
  std::string host = target.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);

  const bool uses_tls = !security.ca.empty();
  const Context context(SSL_CTX_new(TLS_client_method()));
  if (uses_tls) {
    if (std::string problem = load_files(context.get(), security); !problem.empty()) return problem;
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  }
  SSL_CTX_set_alpn_protos(context.get(), kProtocols.data(), kProtocols.size());
  Socket socket;
  if (!connect_to(host, target.substr(colon + 1), socket)) return "";
  const Session session(SSL_new(context.get()));
  SSL_set_fd(session.get(), socket.fd);
  if (uses_tls) expect_host(session.get(), host);

  ERR_clear_error();
  const bool has_shaken_hands = SSL_connect(session.get()) == 1;
  if (!uses_tls) return has_shaken_hands ? "the server speaks TLS: name its authorities with --tls-ca" : "";
  if (!has_shaken_hands) return explain_refusal_of_server(session.get(), host, security);
  // A server that is content begins to speak.
  char byte = 0;
  if (SSL_read(session.get(), &byte, 1) == 1 || ERR_peek_error() == 0) return "";
  return explain_refusal_of_client(security);
}

}  // namespace radbake::api
