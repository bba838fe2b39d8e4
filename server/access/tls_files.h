#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace radbake::access {

/// PEM files. Empty: not given.
struct TlsFiles {
  std::filesystem::path certificate;  ///< the server's, then its chain
  std::filesystem::path key;
  std::filesystem::path client_ca;  ///< who signs clients' certificates

  bool operator==(const TlsFiles&) const = default;
};

/// The files' texts, checked.
struct TlsMaterial {
  std::string certificate, key, client_ca;
};

/// Reads the files and checks that all can be parsed, that the certificate is valid now and that the key is its own.
///
/// Errors: kInvalidArgument or kNotFound, with the option and its file.
Result<TlsMaterial> read_tls_files(const TlsFiles& files);

}  // namespace radbake::access
