#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace radbake::gltf {

/// The largest index or count that fits tinygltf's int.
inline constexpr std::uint64_t kMaxInt = std::numeric_limits<std::int32_t>::max();

/// A text from a file, fit for a terminal: control characters become '?', and it is cut at 200 bytes.
std::string printable(std::string_view name);

/// The same in quotes, cut at 60 bytes.
std::string in_quotes(std::string_view name);

/// "accessor 3" or "mesh 2 'Cube'".
std::string numbered(std::string_view thing, std::size_t index, std::string_view name = {});

/// One JSON object of the file with the name by which messages call it: "accessor 3".
/// What is absent is right unless required; what is present must be of the right kind: the loader after us silently
/// replaces wrong kinds by defaults.
class Entry {
 public:
  /// Precondition: object is a JSON object that outlives this.
  Entry(const nlohmann::json& object, std::string name) : object_(&object), name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  /// The member, or null.
  const nlohmann::json* find(const char* key) const;

  Result<std::optional<std::uint64_t>> whole_number(const char* key, std::uint64_t max = kMaxInt) const;
  Result<std::uint64_t> required_whole_number(const char* key, std::uint64_t max = kMaxInt) const;
  /// An index into a list of the file: below size.
  Result<std::optional<std::uint64_t>> index(const char* key, std::size_t size, const char* list) const;
  /// A number in [low, high].
  Result<void> number(const char* key, double low = -std::numeric_limits<double>::max(),
                      double high = std::numeric_limits<double>::max()) const;
  /// An array of exactly size numbers, each in [low, high].
  Result<void> numbers(const char* key, std::size_t size, double low = -std::numeric_limits<double>::max(),
                       double high = std::numeric_limits<double>::max()) const;
  Result<void> text(const char* key) const;
  Result<void> flag(const char* key) const;
  /// An array of indices below size.
  Result<std::vector<std::uint64_t>> indices(const char* key, std::size_t size, const char* list) const;
  /// A member object, named "<this name>, <key>".
  Result<std::optional<Entry>> member(const char* key) const;
  /// The object of an extension.
  Result<std::optional<Entry>> extension(const char* key) const;
  /// The objects of an array: named "<thing> <index> '<name>'", or "<this name>, <thing> <index>" unless at the root.
  Result<std::vector<Entry>> list(const char* key, const char* thing) const;

  /// An error that starts with this name.
  Error error(const std::string& message) const;

 private:
  const nlohmann::json* object_;
  std::string name_;  // empty at the root
};

}  // namespace radbake::gltf
