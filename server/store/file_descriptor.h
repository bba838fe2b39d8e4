#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "common/base/result.h"

namespace radbake::store {

/// An open file descriptor, closed at the end of its life.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() { reset(); }
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) {
      reset();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }

  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  int release() { return std::exchange(fd_, -1); }
  void reset() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_ = -1;
};

/// The error of the system call that just failed, as "what: reason". A full disk is kResourceExhausted, a missing file
/// kNotFound, want of descriptors or memory kUnavailable, all else kInternal.
Error system_error(const std::string& what);

/// Opens a file, never inherited by child processes unless asked for.
Result<FileDescriptor> open_file(const std::filesystem::path& path, int flags);

// Errors name a file as `name` says: clients read them, too, and need not know where the server keeps what.

/// The same for a file that errors are to name so.
Result<FileDescriptor> open_file(const std::filesystem::path& path, int flags, const std::string& name);

/// Writes all bytes at an offset.
Result<void> write_all(int fd, std::span<const std::byte> bytes, std::uint64_t offset, const std::string& name);

/// Reads up to `limit` bytes at an offset; fewer only at the end of the file.
Result<std::string> read_range(int fd, std::uint64_t offset, std::uint64_t limit, const std::string& name);

/// Forces a file or a folder to the disk. After an error nobody knows what arrived: give the file up, never try again.
Result<void> sync(int fd, const std::string& name);
Result<void> sync_folder(const std::filesystem::path& folder, const std::string& name);

/// Creates a folder and its parents where missing.
Result<void> make_folders(const std::filesystem::path& folder, const std::string& name);
inline Result<void> make_folders(const std::filesystem::path& folder) { return make_folders(folder, folder.string()); }

}  // namespace radbake::store
