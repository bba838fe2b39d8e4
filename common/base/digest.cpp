#include "common/base/digest.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "common/base/shortened.h"

namespace radbake {

struct Sha256::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~State() { EVP_MD_CTX_free(context); }
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  RADBAKE_CHECK(EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr) == 1);
}
Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(std::span<const std::byte> bytes) {
  RADBAKE_CHECK(EVP_DigestUpdate(state_->context, bytes.data(), bytes.size()) == 1);
}

std::string Sha256::finish() {
  std::array<unsigned char, 32> hash{};
  RADBAKE_CHECK(EVP_DigestFinal_ex(state_->context, hash.data(), nullptr) == 1);
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(64);
  for (const unsigned char byte : hash) {
    text.push_back(kDigits[byte >> 4]);
    text.push_back(kDigits[byte & 15]);
  }
  return text;
}

Digest digest_of(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.update(bytes);
  return {hash.finish(), bytes.size()};
}

Digest digest_of(const std::string& bytes) { return digest_of(std::as_bytes(std::span(bytes))); }

Result<void> validate_sha256(const std::string& sha256) {
  const bool is_hex = std::all_of(sha256.begin(), sha256.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (sha256.size() == 64 && is_hex) return {};
  return invalid_argument("'" + shortened(sha256, 80) + "' is not a SHA-256 digest (64 lower-case hexadecimal digits)");
}

}  // namespace radbake
