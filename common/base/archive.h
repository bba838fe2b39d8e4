#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace radbake {

// State of this program as bytes, for a later process of the same build on the same machine: nothing is said of types
// or byte order. What can be kept has one function that lists its members for both ways:
//
//   template <typename Archive> void keep(Archive& archive) { archive(count_); archive(values_); }

/// Of whatever is kept between processes: raised when a layout changes, so that older bytes are known as such.
inline constexpr std::uint32_t kArchiveLayout = 1;

/// Counts the bytes that an ArchiveWriter would make.
class ArchiveSize {
 public:
  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(const Value&) { bytes_ += sizeof(Value); }
  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(const std::vector<Value>& values) { bytes_ += sizeof(std::uint64_t) + values.size() * sizeof(Value); }
  void operator()(const std::string& text) { bytes_ += sizeof(std::uint64_t) + text.size(); }
  template <typename Value>
  void of_known_size(const std::vector<Value>& values) {
    (*this)(values);
  }
  bool can_hold(std::uint64_t, std::size_t) const { return true; }

  std::size_t bytes() const { return bytes_; }

 private:
  std::size_t bytes_ = 0;
};

/// Appends values to bytes.
class ArchiveWriter {
 public:
  ArchiveWriter() = default;
  /// Room for so many bytes: they are never held twice while they grow.
  explicit ArchiveWriter(std::size_t num_bytes) { bytes_.reserve(num_bytes); }

  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(const Value& value) { put(&value, sizeof value); }
  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(const std::vector<Value>& values) {
    (*this)(static_cast<std::uint64_t>(values.size()));
    if (!values.empty()) put(values.data(), values.size() * sizeof(Value));
  }
  void operator()(const std::string& text) {
    (*this)(static_cast<std::uint64_t>(text.size()));
    bytes_ += text;
  }
  /// As a vector whose size the reader knows.
  template <typename Value>
  void of_known_size(const std::vector<Value>& values) {
    (*this)(values);
  }

  bool can_hold(std::uint64_t, std::size_t) const { return true; }

  std::string take() { return std::move(bytes_); }

 private:
  void put(const void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }

  std::string bytes_;
};

/// Takes values off bytes that nobody has checked: whatever does not fit leaves is_good() false, and the values as they
/// were.
class ArchiveReader {
 public:
  explicit ArchiveReader(std::string_view bytes) : rest_(bytes) {}

  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(Value& value) { get(&value, sizeof value); }
  template <typename Value>
  requires std::is_trivially_copyable_v<Value>
  void operator()(std::vector<Value>& values) {
    std::uint64_t size = 0;
    (*this)(size);
    if (!is_good_ || size > rest_.size() / sizeof(Value)) return fail();
    values.resize(size);
    if (size > 0) get(values.data(), size * sizeof(Value));
  }
  void operator()(std::string& text) {
    std::uint64_t size = 0;
    (*this)(size);
    if (!is_good_ || size > rest_.size()) return fail();
    text.assign(rest_.substr(0, size));
    rest_.remove_prefix(size);
  }
  /// Fails where there are not as many as `values` has.
  template <typename Value>
  void of_known_size(std::vector<Value>& values) {
    std::uint64_t size = 0;
    (*this)(size);
    if (!is_good_ || size != values.size()) return fail();
    if (size > 0) get(values.data(), size * sizeof(Value));
  }

  /// Whether what is left may be so many of at least so many bytes; fails where not.
  bool can_hold(std::uint64_t count, std::size_t least_bytes) {
    if (!is_good_ || count > rest_.size() / least_bytes) fail();
    return is_good_;
  }

  bool is_good() const { return is_good_; }
  /// All is taken, and all was well.
  bool is_at_end() const { return is_good_ && rest_.empty(); }
  void fail() { is_good_ = false; }

 private:
  void get(void* data, std::size_t size) {
    if (!is_good_ || size > rest_.size()) return fail();
    std::memcpy(data, rest_.data(), size);
    rest_.remove_prefix(size);
  }

  std::string_view rest_;
  bool is_good_ = true;
};

}  // namespace radbake
