#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
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

struct ContentLimits {
  std::uint64_t max_blob_bytes = 0;
  std::uint64_t max_bytes = 0;  ///< of all blobs, uploads included that have begun; 0: as the disk has
};

/// Blobs on disk, named by their digest. Thread-safe.
///
///   objects/ab/ab12...        complete blobs: size and SHA-256 checked, forced to the disk before the name appears
///   temporary/upload-ab12-N   blobs of N bytes that grow; they outlive the server, and are hashed anew then
///   temporary/K               results that grow; removed when the store is opened
///
/// Several clients may upload one blob at the same time: since its digest says what every byte is, they share one
/// growing file, and bytes that are there already are skipped. Bytes that turn out wrong end it for all of them.
///
/// Whoever asks for a blob keeps it for a while: its file's time is set to now, and sweep() takes old ones only.
///
/// Errors: kDataLoss for bytes that are not what their digest says; kResourceExhausted above a limit or on a full disk;
/// kFailedPrecondition for a gap; kNotFound for a blob that is not there; kInternal from the disk.
class ContentStore {
 public:
  /// Opens the store in a folder, creating it where missing. One process at a time.
  static Result<std::unique_ptr<ContentStore>> open(const std::filesystem::path& folder, const ContentLimits& limits);
  ~ContentStore();

  bool contains(const Digest& digest) const;
  std::vector<Digest> find_missing(std::span<const Digest> digests) const;

  /// Adds bytes that start at an offset of the blob; returns how many are committed now. The first bytes of a blob
  /// reserve the room for all of it.
  Result<std::uint64_t> append_upload(const Digest& digest, std::uint64_t offset, std::span<const std::byte> bytes);
  /// Checks what was uploaded and names it. A second call for a blob that is complete succeeds.
  Result<void> finish_upload(const Digest& digest);
  /// Committed bytes survive a broken connection and the end of the server; after a power loss some may be wrong, which
  /// shows when the upload is finished.
  UploadProgress query_upload(const Digest& digest) const;
  /// Received of all uploads that are not complete.
  std::uint64_t upload_bytes() const;

  /// A blob whose digest is known only when its last byte is: a result. No limit holds for it: it has taken hours.
  Result<std::unique_ptr<BlobWriter>> new_blob();
  Result<void> commit(BlobWriter& blob, const Digest& expected);

  /// A read-only descriptor.
  Result<FileDescriptor> open_blob(const Digest& digest) const;
  Result<std::string> read_blob(const Digest& digest) const;

  /// Removes a blob at once, whoever asked for it. None: nothing happens.
  void remove(const Digest& digest);

  /// Of all blobs, and what uploads have reserved.
  std::uint64_t used_bytes() const;
  /// Called where an upload does not fit, with the bytes that are lacking; may sweep().
  void set_make_room(std::function<void(std::uint64_t bytes)> make_room) { make_room_ = std::move(make_room); }
  /// Called where the disk refuses what an upload brings, from any thread; must be quick.
  void set_on_refusal(std::function<void(const Error&)> on_refusal) { on_refusal_ = std::move(on_refusal); }
  /// Removes blobs that nobody needs and nobody has asked for since a time, the oldest first, until so many bytes are
  /// free; and uploads that have rested as long. Returns the bytes.
  Result<std::uint64_t> sweep(const std::set<Digest>& needed, std::chrono::system_clock::time_point unused_since,
                              std::uint64_t bytes);
  /// Closes the files of uploads that rest since a time; they go on where they ended.
  void close_resting_uploads(std::chrono::steady_clock::time_point since);

  /// Writes, forces to the disk and removes a small file: whether the disk takes anything at all.
  Result<void> probe();

 private:
  struct Upload {
    std::mutex mutex;
    std::unique_ptr<BlobWriter> writer;  // null: its file is closed, or it has none yet
    bool is_over = false;                // complete or given up
    std::atomic<std::uint64_t> num_bytes = 0;
    std::chrono::steady_clock::time_point used_at;
  };

  static constexpr const char* kUploadPrefix = "upload-";

  ContentStore(std::filesystem::path folder, const ContentLimits& limits);
  Result<void> take_stock();
  Result<void> take_stock_of_uploads();
  /// The folder of a blob, created and forced to the disk where it is the first there.
  Result<std::filesystem::path> make_shelf(const Digest& digest);
  Result<void> validate(const Digest& digest) const;
  std::filesystem::path path_of(const Digest& digest) const;
  std::filesystem::path upload_path(const Digest& digest) const;
  Result<std::shared_ptr<Upload>> find_or_start_upload(const Digest& digest);
  /// Opens its file, where it is closed. Precondition: the upload's lock is held.
  Result<void> wake_upload(const Digest& digest, Upload& upload);
  void end_upload(const Digest& digest, Upload& upload);
  Error upload_has_ended(const Digest& digest) const;
  /// Ends it, and tells of a disk that refused. Precondition: as end_upload().
  void give_up_upload(const Digest& digest, Upload& upload, const Error& problem);

  const std::filesystem::path folder_;
  const ContentLimits limits_;
  std::function<void(std::uint64_t)> make_room_;
  std::function<void(const Error&)> on_refusal_;
  std::atomic<std::uint64_t> next_temporary_ = 0;
  mutable std::shared_mutex sweeping_;  // held alone while a blob is removed
  mutable std::mutex mutex_;            // guards what follows
  std::uint64_t object_bytes_ = 0, reserved_bytes_ = 0;
  std::map<Digest, std::shared_ptr<Upload>> uploads_;
  std::set<std::filesystem::path> shelves_;  // that are on the disk
};

}  // namespace radbake::store
