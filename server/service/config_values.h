#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>

namespace radbake::service {

/// What may stand behind a key of the configuration: how it is read, how it is written, and how it is described to
/// somebody who wrote something else.
template <typename T>
struct ValueKind {
  std::string type_name;  ///< in the help: SIZE
  std::string expected;   ///< after "expected": "a size from 1K to 4M, such as 128K"
  std::function<std::optional<T>(const std::string&)> read;
  std::function<std::string(const T&)> write;
};

/// Decimal digits and nothing else.
ValueKind<std::uint64_t> whole_number(std::uint64_t least, std::uint64_t most);
/// Bytes, with K, M, G or T for 1024, 1024^2, ...
ValueKind<std::uint64_t> byte_size(std::uint64_t least, std::uint64_t most);
/// Seconds with at most three decimals.
ValueKind<std::chrono::milliseconds> seconds(double least, double most);
ValueKind<std::string> one_of(std::initializer_list<const char*> words);
/// Not empty.
ValueKind<std::filesystem::path> path_of(const std::string& what);
/// HOST:PORT with a port from 0 to 65535, and unix:PATH where allowed: a path that fits into a socket's address.
ValueKind<std::string> address(bool allows_unix);

/// As it is written: the largest unit that divides it. write_bytes(131072) is "128K".
std::string write_bytes(std::uint64_t bytes);

}  // namespace radbake::service
