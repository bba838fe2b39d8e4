#include "common/codec/draco_peek.h"

namespace radbake {
namespace {

/// Reads bytes and varints one after another; remembers when they ended.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  unsigned byte() {
    if (at_ < bytes_.size()) return static_cast<unsigned char>(bytes_[at_++]);
    is_past_end_ = true;
    return 0;
  }
  /// Seven bits a byte, lowest first; at most 32 bits.
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      const unsigned next = byte();
      value |= std::uint64_t{next & 0x7f} << shift;
      if (next < 0x80) return value;
    }
    is_past_end_ = true;
    return 0;
  }
  bool is_past_end() const { return is_past_end_; }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
  bool is_past_end_ = false;
};

}  // namespace

Result<DracoClaims> peek_draco(const std::string& blob) {
  if (!blob.starts_with("DRACO")) return invalid_argument("is not a Draco file");
  Reader reader(blob);
  for (int i = 0; i < 5; ++i) reader.byte();
  const unsigned major = reader.byte(), minor = reader.byte(), type = reader.byte(), method = reader.byte();
  const unsigned flags = reader.byte() | reader.byte() << 8;
  if (major != 2 || minor != 2) {
    return invalid_argument("is Draco " + std::to_string(major) + "." + std::to_string(minor) + ", not 2.2");
  }
  if (type != 1) return invalid_argument("is not a triangle mesh (Draco geometry type " + std::to_string(type) + ")");
  if (flags != 0) return invalid_argument("has metadata or unknown flags (" + std::to_string(flags) + ")");

  DracoClaims claims;
  if (method == 0) {
    claims.num_faces = reader.varint();
    claims.num_points = reader.varint();
  } else if (method == 1) {
    const unsigned traversal = reader.byte();
    if (traversal != 0 && traversal != 2) {
      return invalid_argument("has an unknown edgebreaker traversal " + std::to_string(traversal));
    }
    claims.num_points = reader.varint();
    claims.num_faces = reader.varint();
    claims.num_connectivities = reader.byte();
    reader.varint();  // symbols: Draco allocates nothing for them
    claims.num_split_symbols = reader.varint();
  } else {
    return invalid_argument("has an unknown Draco method " + std::to_string(method));
  }
  if (reader.is_past_end()) return invalid_argument("ends within its head");
  return claims;
}

}  // namespace radbake
