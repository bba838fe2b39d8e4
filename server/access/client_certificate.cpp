#include "server/access/client_certificate.h"

#include <openssl/x509v3.h>

#include <memory>
#include <vector>

#include "server/access/pem.h"

namespace radbake::access {
namespace {

struct FreeNames {
  void operator()(GENERAL_NAMES* names) const { GENERAL_NAMES_free(names); }
};

std::string text_of(const ASN1_STRING* string) {
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, string);
  if (size < 0) return "";
  std::string text(reinterpret_cast<char*>(utf8), static_cast<std::size_t>(size));
  OPENSSL_free(utf8);
  return text;
}

/// All values of one kind in the certificate's subject.
std::vector<std::string> subject_values(const X509* certificate, int kind) {
  const X509_NAME* subject = X509_get_subject_name(certificate);
  std::vector<std::string> values;
  for (int at = X509_NAME_get_index_by_NID(subject, kind, -1); at >= 0;
       at = X509_NAME_get_index_by_NID(subject, kind, at)) {
    values.push_back(text_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at))));
  }
  return values;
}

/// The first DNS or URI name; empty where there is none.
std::string alternative_name(const X509* certificate) {
  const std::unique_ptr<GENERAL_NAMES, FreeNames> names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type == GEN_DNS) return text_of(name->d.dNSName);
    if (name->type == GEN_URI) return text_of(name->d.uniformResourceIdentifier);
  }
  return "";
}

}  // namespace

Result<Caller> caller_of_certificate(const std::string& pem) {
  RADBAKE_ASSIGN_OR_RETURN(const auto chain, parse_certificates(pem, "the client's certificate"));
  const X509* certificate = chain.front().get();
  const std::vector<std::string> common_names = subject_values(certificate, NID_commonName);
  Caller caller;
  caller.tenant = common_names.empty() ? alternative_name(certificate) : common_names.front();
  if (auto valid = validate_tenant(caller.tenant); !valid.ok()) {
    return invalid_argument("the client's certificate names no tenant by CN, DNS or URI: " + valid.error().message);
  }
  for (const std::string& unit : subject_values(certificate, NID_organizationalUnitName)) {
    if (unit == "admin") caller.role = Role::kAdmin;
  }
  return caller;
}

}  // namespace radbake::access
