#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "server/store/blob_writer.h"
#include "server/store/file_descriptor.h"

namespace radbake::store {

/// How far an upload came.
struct UploadProgress {
  std::uint64_t committed_bytes = 0;
  bool is_complete = false;
};

/// Blobs on disk, named by their digest. Thread-safe.
///
///   objects/ab/ab12...   complete blobs: size and SHA-256 checked, forced to the disk before the name appears
///   temporary/           blobs that grow; emptied when the store is opened
///
/// Several clients may upload one blob at the same time: since its digest says what every byte is, they share one
/// growing file, and bytes that are there already are skipped. Bytes that turn out wrong end it for all of them.
///
/// Errors: kDataLoss for bytes that are not what their digest says; kResourceExhausted above max_blob_bytes or on a
/// full disk; kFailedPrecondition for a gap; kNotFound for a blob that is not there.
class ContentStore {
 public:
  /// Opens the store in a folder, creating it where missing. One process at a time.
  static Result<std::unique_ptr<ContentStore>> open(const std::filesystem::path& folder, std::uint64_t max_blob_bytes);

  bool contains(const Digest& digest) const;
  std::vector<Digest> find_missing(std::span<const Digest> digests) const;

  /// Adds bytes that start at an offset of the blob; returns how many are committed now.
  Result<std::uint64_t> append_upload(const Digest& digest, std::uint64_t offset, std::span<const std::byte> bytes);
  /// Checks what was uploaded and names it. A second call for a blob that is complete succeeds.
  Result<void> finish_upload(const Digest& digest);
  /// Committed bytes survive a broken connection, not the end of the server.
  UploadProgress query_upload(const Digest& digest) const;
  /// Received of all uploads that are not complete.
  std::uint64_t upload_bytes() const;

  /// A blob whose digest is known only when its last byte is: a result.
  Result<std::unique_ptr<BlobWriter>> new_blob();
  Result<void> commit(BlobWriter& blob, const Digest& expected);

  /// A read-only descriptor.
  Result<FileDescriptor> open_blob(const Digest& digest) const;
  Result<std::string> read_blob(const Digest& digest) const;

 private:
  struct Upload {
    std::mutex mutex;
    std::unique_ptr<BlobWriter> writer;
    bool is_over = false;  // complete or given up
  };

  ContentStore(std::filesystem::path folder, std::uint64_t max_blob_bytes);
  Result<void> validate(const Digest& digest) const;
  std::filesystem::path path_of(const Digest& digest) const;
  Result<std::shared_ptr<Upload>> find_or_start_upload(const Digest& digest);
  void end_upload(const Digest& digest, Upload& upload);

  const std::filesystem::path folder_;
  const std::uint64_t max_blob_bytes_;
  std::atomic<std::uint64_t> next_temporary_ = 0;
  mutable std::mutex mutex_;  // guards uploads_
  std::map<Digest, std::shared_ptr<Upload>> uploads_;
};

}  // namespace radbake::store
