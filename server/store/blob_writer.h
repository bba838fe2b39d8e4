#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "server/store/file_descriptor.h"

namespace radbake::store {

/// A blob that grows in a temporary file and is hashed on the way. Made by ContentStore::new_blob(); what is not
/// committed there is removed. Not thread-safe.
class BlobWriter {
 public:
  static Result<std::unique_ptr<BlobWriter>> create(const std::filesystem::path& temporary);
  /// Goes on with what stands in a file, or begins it.
  static Result<std::unique_ptr<BlobWriter>> resume(const std::filesystem::path& temporary);
  ~BlobWriter();
  BlobWriter(const BlobWriter&) = delete;
  BlobWriter& operator=(const BlobWriter&) = delete;

  std::uint64_t size() const { return size_; }

  /// Appends bytes. After an error the writer is of no more use.
  Result<void> append(std::span<const std::byte> bytes);
  /// Forces what was written to the disk.
  Result<void> force() { return sync(file_.get(), kName); }
  /// Leaves the file where it is, for resume().
  void keep() { is_kept_ = true; }

 private:
  friend class ContentStore;
  static constexpr const char* kName = "a blob in the content store";  ///< in errors
  BlobWriter(std::filesystem::path temporary, FileDescriptor file);

  /// Checks size and digest, forces the bytes to the disk and gives them their name. The caller syncs the folder.
  Result<void> publish(const Digest& expected, const std::filesystem::path& name);

  std::filesystem::path temporary_;
  FileDescriptor file_;
  Sha256 hash_;
  std::uint64_t size_ = 0;
  bool is_kept_ = false;  // under this name or another
};

}  // namespace radbake::store
