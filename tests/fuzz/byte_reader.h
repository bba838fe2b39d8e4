#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace radbake::fuzz {

/// Takes a fuzzer's input apart, byte after byte; past its end all is 0.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), size_(size) {}

  bool is_at_end() const { return at_ == size_; }
  unsigned byte() { return at_ < size_ ? bytes_[at_++] : 0; }
  unsigned two_bytes() {
    const unsigned low = byte();
    return low | byte() << 8;
  }
  std::string rest() {
    std::string bytes(reinterpret_cast<const char*>(bytes_) + at_, size_ - at_);
    at_ = size_;
    return bytes;
  }

 private:
  const std::uint8_t* bytes_;
  std::size_t size_;
  std::size_t at_ = 0;
};

}  // namespace radbake::fuzz
