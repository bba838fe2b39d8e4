#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/access/caller.h"

namespace radbake::access {

/// Bearer tokens that are accepted, known by their SHA-256 alone: who reads the file cannot call.
///
/// One token a line, the parts apart by blanks; `#` starts a comment:
///
///   SHA256_HEX TENANT ROLE
class TokenSet {
 public:
  /// Errors: kInvalidArgument, with the file's name and the line.
  static Result<TokenSet> parse(const std::string& text, const std::string& name);
  static Result<TokenSet> read(const std::filesystem::path& file);

  /// Whose token this is. The presented token's hash is held against every entry, each in constant time, so the time
  /// says nothing of where or how nearly it matched.
  std::optional<Caller> find(std::string_view token) const;

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::string sha256;
    Caller caller;
  };
  std::vector<Entry> entries_;
};

/// The hash of a token as the file holds it. Errors: kInvalidArgument for a token that nobody could send (blanks, bytes
/// that are not ASCII) or that could be guessed (below 32 characters): the hash has no salt, the token must be random.
Result<std::string> hash_token(const std::string& token);

}  // namespace radbake::access
