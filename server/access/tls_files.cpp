#include "server/access/tls_files.h"

#include <openssl/asn1.h>

#include "server/access/pem.h"

namespace radbake::access {
namespace {

std::string text_of(const ASN1_TIME* time) {
  tm calendar{};
  char text[32] = "?";
  if (ASN1_TIME_to_tm(time, &calendar) == 1) strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &calendar);
  return text;
}

Result<void> check_dates(const X509* certificate, const std::string& name) {
  const ASN1_TIME* begin = X509_get0_notBefore(certificate);
  const ASN1_TIME* end = X509_get0_notAfter(certificate);
  if (X509_cmp_current_time(end) <= 0)
    return invalid_argument(name + ": the certificate has expired at " + text_of(end));
  if (X509_cmp_current_time(begin) > 0) {
    return invalid_argument(name + ": the certificate is not valid before " + text_of(begin));
  }
  return {};
}

}  // namespace

Result<TlsMaterial> read_tls_files(const TlsFiles& files) {
  TlsMaterial material;
  const std::string certificate_name = "--tls-cert " + files.certificate.string();
  const std::string key_name = "--tls-key " + files.key.string();
  RADBAKE_ASSIGN_OR_RETURN(material.certificate, read_small_file(files.certificate, "--tls-cert"));
  RADBAKE_ASSIGN_OR_RETURN(const auto chain, parse_certificates(material.certificate, certificate_name));
  RADBAKE_RETURN_IF_ERROR(check_dates(chain.front().get(), certificate_name));
  RADBAKE_ASSIGN_OR_RETURN(material.key, read_small_file(files.key, "--tls-key"));
  RADBAKE_ASSIGN_OR_RETURN(const PrivateKey key, parse_private_key(material.key, key_name));
  if (X509_check_private_key(chain.front().get(), key.get()) != 1) {
    return invalid_argument(key_name + " is not the key of " + certificate_name);
  }
  if (!files.client_ca.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(material.client_ca, read_small_file(files.client_ca, "--tls-client-ca"));
    const auto authorities = parse_certificates(material.client_ca, "--tls-client-ca " + files.client_ca.string());
    if (!authorities.ok()) return authorities.error();
  }
  return material;
}

}  // namespace radbake::access
