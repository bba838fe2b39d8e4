#include "server/access/token_set.h"

#include <fcntl.h>
#include <openssl/crypto.h>

#include <algorithm>
#include <sstream>

#include "common/base/digest.h"
#include "server/access/pem.h"

namespace radbake::access {
namespace {

constexpr std::size_t kMinTokenBytes = 32;
constexpr std::size_t kMaxTokenBytes = 4096;

}  // namespace

Result<TokenSet> TokenSet::parse(const std::string& text, const std::string& name) {
  TokenSet set;
  std::istringstream lines(text);
  std::size_t line_number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++line_number;
    const auto wrong = [&](const std::string& what) {
      return invalid_argument(name + ":" + std::to_string(line_number) + ": " + what);
    };
    std::istringstream words(line.substr(0, line.find('#')));
    std::string sha256, tenant, role, more;
    if (!(words >> sha256)) continue;
    if (!(words >> tenant >> role) || words >> more) return wrong("expected SHA256_HEX TENANT ROLE");
    // The text may be a token that somebody forgot to hash: it is not repeated.
    if (!validate_sha256(sha256).ok()) {
      return wrong("the first word is not a SHA-256 in 64 lower-case hexadecimal digits (radbaked --hash-token)");
    }
    if (auto valid = validate_tenant(tenant); !valid.ok()) return wrong(valid.error().message);
    const Result<Role> parsed = parse_role(role);
    if (!parsed.ok()) return wrong(parsed.error().message);
    const bool is_twice =
        std::any_of(set.entries_.begin(), set.entries_.end(), [&](const Entry& e) { return e.sha256 == sha256; });
    if (is_twice) return wrong("the token " + sha256 + " is there twice");
    set.entries_.push_back({sha256, {tenant, *parsed}});
  }
  return set;
}

Result<TokenSet> TokenSet::read(const std::filesystem::path& file) {
  RADBAKE_ASSIGN_OR_RETURN(const std::string text, read_small_file(file, "--tokens"));
  return parse(text, "--tokens " + file.string());
}

std::optional<Caller> TokenSet::find(std::string_view token) const {
  const std::string sha256 = digest_of(std::string(token)).sha256;
  const Entry* found = nullptr;
  for (const Entry& entry : entries_) {
    const bool is_equal = CRYPTO_memcmp(entry.sha256.data(), sha256.data(), sha256.size()) == 0;
    found = is_equal ? &entry : found;
  }
  return found == nullptr ? std::nullopt : std::optional(found->caller);
}

Result<std::string> hash_token(const std::string& token) {
  if (token.size() < kMinTokenBytes || token.size() > kMaxTokenBytes) {
    return invalid_argument("a token must have " + std::to_string(kMinTokenBytes) + " to " +
                            std::to_string(kMaxTokenBytes) + " characters, not " + std::to_string(token.size()) +
                            ": head -c 32 /dev/urandom | base64 makes one");
  }
  const bool is_visible = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!is_visible) return invalid_argument("a token must be visible ASCII characters without blanks");
  return digest_of(token).sha256;
}

}  // namespace radbake::access
