#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"

namespace radbake {

/// The name of a blob: SHA-256 in 64 lower-case hexadecimal digits, and size.
struct Digest {
  std::string sha256;
  std::uint64_t size_bytes = 0;

  auto operator<=>(const Digest&) const = default;
};

/// Digest of bytes in memory.
Digest digest_of(std::span<const std::byte> bytes);
Digest digest_of(const std::string& bytes);

/// Checks that the text is 64 lower-case hexadecimal digits (so it is also safe as a file name).
Result<void> validate_sha256(const std::string& sha256);

/// SHA-256 of bytes that arrive in pieces. FIPS 180-4, by OpenSSL.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void update(std::span<const std::byte> bytes);
  /// 64 lower-case hexadecimal digits. Call once, at the end.
  std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace radbake
