#include "server/store/content_store.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "server/store/failpoint.h"

namespace radbake::store {
namespace {

using std::chrono::system_clock;

const char* const kShelves = "the content store";  // in errors

/// Blobs' times are not set anew more often than this.
constexpr std::chrono::minutes kTouchInterval{5};

void touch(const std::filesystem::path& path) { ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0); }

}  // namespace

Result<std::unique_ptr<ContentStore>> ContentStore::open(const std::filesystem::path& folder,
                                                         const ContentLimits& limits) {
  RADBAKE_RETURN_IF_ERROR(make_folders(folder / "temporary"));
  RADBAKE_RETURN_IF_ERROR(make_folders(folder / "objects"));
  std::unique_ptr<ContentStore> store(new ContentStore(folder, limits));
  RADBAKE_RETURN_IF_ERROR(store->take_stock());
  return store;
}

ContentStore::ContentStore(std::filesystem::path folder, const ContentLimits& limits)
    : folder_(std::move(folder)), limits_(limits) {}

ContentStore::~ContentStore() {
  for (const auto& [digest, upload] : uploads_) {
    if (upload->writer) upload->writer->keep();
  }
}

Result<void> ContentStore::validate(const Digest& digest) const {
  RADBAKE_RETURN_IF_ERROR(validate_sha256(digest.sha256));
  if (digest.size_bytes > limits_.max_blob_bytes) {
    return Error{ErrorCode::kResourceExhausted, "blob " + digest.sha256 + " of " + std::to_string(digest.size_bytes) +
                                                    " bytes is above max_blob_bytes " +
                                                    std::to_string(limits_.max_blob_bytes)};
  }
  return {};
}

std::filesystem::path ContentStore::path_of(const Digest& digest) const {
  return folder_ / "objects" / digest.sha256.substr(0, 2) / digest.sha256;
}

std::filesystem::path ContentStore::upload_path(const Digest& digest) const {
  return folder_ / "temporary" / (kUploadPrefix + digest.sha256 + "-" + std::to_string(digest.size_bytes));
}

bool ContentStore::contains(const Digest& digest) const {
  if (!validate_sha256(digest.sha256).ok()) return false;
  const std::filesystem::path path = path_of(digest);
  const std::shared_lock lock(sweeping_);
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0 || static_cast<std::uint64_t>(facts.st_size) != digest.size_bytes) return false;
  const system_clock::time_point used_at{std::chrono::seconds(facts.st_mtim.tv_sec)};
  if (system_clock::now() - used_at > kTouchInterval) touch(path);
  return true;
}

std::vector<Digest> ContentStore::find_missing(std::span<const Digest> digests) const {
  std::vector<Digest> missing;
  std::copy_if(digests.begin(), digests.end(), std::back_inserter(missing),
               [this](const Digest& digest) { return !contains(digest); });
  return missing;
}

Result<std::shared_ptr<ContentStore::Upload>> ContentStore::find_or_start_upload(const Digest& digest) {
  for (bool has_made_room = false;; has_made_room = true) {
    std::uint64_t lacking = 0;
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = uploads_.find(digest); found != uploads_.end()) return found->second;
      const std::uint64_t wanted = object_bytes_ + reserved_bytes_ + digest.size_bytes;
      if (limits_.max_bytes == 0 || wanted <= limits_.max_bytes) {
        reserved_bytes_ += digest.size_bytes;
        return uploads_[digest] = std::make_shared<Upload>();
      }
      lacking = wanted - limits_.max_bytes;
      if (has_made_room || !make_room_) {
        return Error{ErrorCode::kResourceExhausted,
                     "blob " + digest.sha256 + " of " + std::to_string(digest.size_bytes) +
                         " bytes does not fit: " + std::to_string(object_bytes_ + reserved_bytes_) +
                         " bytes are used, max_content_bytes is " + std::to_string(limits_.max_bytes)};
      }
    }
    make_room_(lacking);
  }
}

Result<void> ContentStore::wake_upload(const Digest& digest, Upload& upload) {
  upload.used_at = std::chrono::steady_clock::now();
  if (upload.writer) return {};
  RADBAKE_ASSIGN_OR_RETURN(upload.writer, BlobWriter::resume(upload_path(digest)));
  upload.num_bytes = upload.writer->size();
  return {};
}

void ContentStore::end_upload(const Digest& digest, Upload& upload) {
  upload.is_over = true;
  upload.writer.reset();
  ::unlink(upload_path(digest).c_str());
  const std::lock_guard lock(mutex_);
  const auto found = uploads_.find(digest);
  if (found == uploads_.end() || found->second.get() != &upload) return;
  reserved_bytes_ -= digest.size_bytes;
  uploads_.erase(found);
}

void ContentStore::give_up_upload(const Digest& digest, Upload& upload, const Error& problem) {
  end_upload(digest, upload);
  const bool is_of_disk = problem.code == ErrorCode::kInternal || problem.code == ErrorCode::kResourceExhausted;
  if (is_of_disk && on_refusal_) on_refusal_(problem);
}

Error ContentStore::upload_has_ended(const Digest& digest) const {
  return {ErrorCode::kUnavailable, "the upload of blob " + digest.sha256 + " ended: start it again"};
}

Result<std::uint64_t> ContentStore::append_upload(const Digest& digest, std::uint64_t offset,
                                                  std::span<const std::byte> bytes) {
  RADBAKE_RETURN_IF_ERROR(validate(digest));
  if (contains(digest)) return digest.size_bytes;
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Upload> upload, find_or_start_upload(digest));
  const std::lock_guard lock(upload->mutex);
  if (upload->is_over) {
    if (contains(digest)) return digest.size_bytes;
    return upload_has_ended(digest);
  }
  if (auto awake = wake_upload(digest, *upload); !awake.ok()) {
    give_up_upload(digest, *upload, awake.error());
    return awake.error();
  }
  const std::uint64_t committed = upload->writer->size();
  if (offset > committed) {
    return Error{ErrorCode::kFailedPrecondition, "blob " + digest.sha256 + ": bytes at offset " +
                                                     std::to_string(offset) + " leave a gap, only " +
                                                     std::to_string(committed) + " are here"};
  }
  const std::uint64_t end = offset + bytes.size();
  if (end > digest.size_bytes) {
    end_upload(digest, *upload);
    return Error{ErrorCode::kDataLoss, "blob " + digest.sha256 + ": bytes up to offset " + std::to_string(end) +
                                           " are beyond its " + std::to_string(digest.size_bytes) + " bytes"};
  }
  if (end <= committed) return committed;
  if (auto appended = upload->writer->append(bytes.subspan(committed - offset)); !appended.ok()) {
    give_up_upload(digest, *upload, appended.error());
    return appended.error();
  }
  upload->num_bytes = end;
  return end;
}

Result<void> ContentStore::finish_upload(const Digest& digest) {
  RADBAKE_RETURN_IF_ERROR(validate(digest));
  if (contains(digest)) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Upload> upload, find_or_start_upload(digest));
  const std::lock_guard lock(upload->mutex);
  if (upload->is_over) {
    if (contains(digest)) return {};
    return upload_has_ended(digest);
  }
  Result<void> committed = wake_upload(digest, *upload);
  if (committed.ok()) committed = commit(*upload->writer, digest);
  if (committed.ok()) {
    end_upload(digest, *upload);
  } else {
    give_up_upload(digest, *upload, committed.error());
  }
  return committed;
}

UploadProgress ContentStore::query_upload(const Digest& digest) const {
  if (contains(digest)) return {digest.size_bytes, true};
  std::shared_ptr<Upload> upload;
  {
    const std::lock_guard lock(mutex_);
    const auto found = uploads_.find(digest);
    if (found == uploads_.end()) return {};
    upload = found->second;
  }
  const std::lock_guard lock(upload->mutex);
  if (upload->is_over) return contains(digest) ? UploadProgress{digest.size_bytes, true} : UploadProgress{};
  if (upload->writer) return {upload->writer->size(), false};
  struct stat facts {};
  if (::stat(upload_path(digest).c_str(), &facts) != 0) return {};
  return {static_cast<std::uint64_t>(facts.st_size), false};
}

Result<std::unique_ptr<BlobWriter>> ContentStore::new_blob() {
  return BlobWriter::create(folder_ / "temporary" / std::to_string(next_temporary_++));
}

Result<std::filesystem::path> ContentStore::make_shelf(const Digest& digest) {
  const std::filesystem::path shelf = path_of(digest).parent_path();
  {
    const std::lock_guard lock(mutex_);
    if (shelves_.contains(shelf)) return shelf;
  }
  RADBAKE_RETURN_IF_ERROR(make_folders(shelf, kShelves));
  RADBAKE_RETURN_IF_ERROR(sync_folder(folder_ / "objects", kShelves));
  const std::lock_guard lock(mutex_);
  shelves_.insert(shelf);
  return shelf;
}

Result<void> ContentStore::commit(BlobWriter& blob, const Digest& expected) {
  RADBAKE_RETURN_IF_ERROR(validate_sha256(expected.sha256));
  const std::filesystem::path name = path_of(expected);
  RADBAKE_ASSIGN_OR_RETURN(const std::filesystem::path shelf, make_shelf(expected));
  bool is_new = false;
  {
    const std::shared_lock lock(sweeping_);
    struct stat facts {};
    is_new = ::stat(name.c_str(), &facts) != 0;
    RADBAKE_RETURN_IF_ERROR(blob.publish(expected, name));
    const std::lock_guard counting(mutex_);
    if (is_new) object_bytes_ += expected.size_bytes;
  }
  failpoint("content.renamed");
  // Without this the name itself may vanish in a power loss: nobody must take it for kept.
  if (auto synced = sync_folder(shelf, kShelves); !synced.ok()) {
    if (is_new) remove(expected);
    return synced;
  }
  failpoint("content.folder_synced");
  return {};
}

Result<FileDescriptor> ContentStore::open_blob(const Digest& digest) const {
  if (!contains(digest)) {
    return Error{ErrorCode::kNotFound, "there is no blob " + digest.sha256.substr(0, 80) + " of " +
                                           std::to_string(digest.size_bytes) + " bytes"};
  }
  return open_file(path_of(digest), O_RDONLY, "blob " + digest.sha256);
}

Result<std::string> ContentStore::read_blob(const Digest& digest) const {
  RADBAKE_ASSIGN_OR_RETURN(const FileDescriptor file, open_blob(digest));
  RADBAKE_ASSIGN_OR_RETURN(std::string bytes, read_range(file.get(), 0, digest.size_bytes, digest.sha256));
  if (bytes.size() == digest.size_bytes) return bytes;
  return Error{ErrorCode::kDataLoss, "blob " + digest.sha256 + " has lost bytes on the disk"};
}

}  // namespace radbake::store
