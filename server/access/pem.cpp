#include "server/access/pem.h"

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/pem.h>

#include <utility>

#include "server/store/file_descriptor.h"

namespace radbake::access {
namespace {

constexpr std::uint64_t kMaxFileBytes = 1 << 20;

struct FreeBio {
  void operator()(BIO* bio) const { BIO_free(bio); }
};
using Bio = std::unique_ptr<BIO, FreeBio>;

Bio read_from(const std::string& text) { return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))); }

/// What OpenSSL says of its last failure, in its own words.
std::string openssl_reason() {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = ERR_reason_error_string(code);
  ERR_clear_error();
  return reason == nullptr ? "not readable" : reason;
}

/// No terminal to ask at.
int no_password(char*, int, int, void*) { return 0; }

}  // namespace

Result<std::string> read_small_file(const std::filesystem::path& file, const std::string& option) {
  auto opened = store::open_file(file, O_RDONLY);
  if (!opened.ok()) return Error{opened.error().code, option + ": " + opened.error().message};
  auto text = store::read_range(opened->get(), 0, kMaxFileBytes + 1, option + " " + file.string());
  if (text.ok() && text->size() > kMaxFileBytes) {
    return invalid_argument(option + " " + file.string() + ": above " + std::to_string(kMaxFileBytes) + " bytes");
  }
  return text;
}

Result<std::vector<Certificate>> parse_certificates(const std::string& pem, const std::string& name) {
  const Bio bio = read_from(pem);
  std::vector<Certificate> certificates;
  ERR_clear_error();
  while (Certificate next{PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr)}) {
    certificates.push_back(std::move(next));
  }
  // The end shows as an error of its own.
  const bool is_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  const std::string reason = openssl_reason();
  if (!is_end)
    return invalid_argument(name + ": certificate " + std::to_string(certificates.size() + 1) + ": " + reason);
  if (certificates.empty()) return invalid_argument(name + ": holds no PEM certificate (-----BEGIN CERTIFICATE-----)");
  return certificates;
}

Result<PrivateKey> parse_private_key(const std::string& pem, const std::string& name) {
  const Bio bio = read_from(pem);
  ERR_clear_error();
  PrivateKey key(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_password, nullptr));
  if (key) return key;
  if (pem.find("ENCRYPTED") != std::string::npos) {
    ERR_clear_error();
    return invalid_argument(name + ": the key asks for a password: a server needs one without");
  }
  return invalid_argument(name + ": no PEM private key: " + openssl_reason());
}

}  // namespace radbake::access
