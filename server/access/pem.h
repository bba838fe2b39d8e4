#pragma once

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace radbake::access {

struct FreeX509 {
  void operator()(X509* certificate) const { X509_free(certificate); }
};
struct FreeKey {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
using Certificate = std::unique_ptr<X509, FreeX509>;
using PrivateKey = std::unique_ptr<EVP_PKEY, FreeKey>;

// `name`: the option and its file, for messages.

/// A file of at most 1 MiB. Errors: those of the system, and kInvalidArgument above the size; both name the option.
Result<std::string> read_small_file(const std::filesystem::path& file, const std::string& option);

/// All certificates of a PEM text, at least one. Errors: kInvalidArgument.
Result<std::vector<Certificate>> parse_certificates(const std::string& pem, const std::string& name);

/// Errors: kInvalidArgument, also for a key that asks for a password.
Result<PrivateKey> parse_private_key(const std::string& pem, const std::string& name);

}  // namespace radbake::access
