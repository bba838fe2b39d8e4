#include "server/store/content_store.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

namespace radbake::store {

Result<std::unique_ptr<ContentStore>> ContentStore::open(const std::filesystem::path& folder,
                                                         std::uint64_t max_blob_bytes) {
  // Remove what a server that was killed left half-written.
  std::error_code reason;
  std::filesystem::remove_all(folder / "temporary", reason);
  if (reason) return internal_error("cannot empty " + (folder / "temporary").string() + ": " + reason.message());
  RADBAKE_RETURN_IF_ERROR(make_folders(folder / "temporary"));
  RADBAKE_RETURN_IF_ERROR(make_folders(folder / "objects"));
  return std::unique_ptr<ContentStore>(new ContentStore(folder, max_blob_bytes));
}

ContentStore::ContentStore(std::filesystem::path folder, std::uint64_t max_blob_bytes)
    : folder_(std::move(folder)), max_blob_bytes_(max_blob_bytes) {}

Result<void> ContentStore::validate(const Digest& digest) const {
  RADBAKE_RETURN_IF_ERROR(validate_sha256(digest.sha256));
  if (digest.size_bytes > max_blob_bytes_) {
    return Error{ErrorCode::kResourceExhausted, "blob " + digest.sha256 + " of " + std::to_string(digest.size_bytes) +
                                                    " bytes is above max_blob_bytes " +
                                                    std::to_string(max_blob_bytes_)};
  }
  return {};
}

std::filesystem::path ContentStore::path_of(const Digest& digest) const {
  return folder_ / "objects" / digest.sha256.substr(0, 2) / digest.sha256;
}

bool ContentStore::contains(const Digest& digest) const {
  if (!validate_sha256(digest.sha256).ok()) return false;
  struct stat facts {};
  return ::stat(path_of(digest).c_str(), &facts) == 0 && static_cast<std::uint64_t>(facts.st_size) == digest.size_bytes;
}

std::vector<Digest> ContentStore::find_missing(std::span<const Digest> digests) const {
  std::vector<Digest> missing;
  std::copy_if(digests.begin(), digests.end(), std::back_inserter(missing),
               [this](const Digest& digest) { return !contains(digest); });
  return missing;
}

Result<std::shared_ptr<ContentStore::Upload>> ContentStore::find_or_start_upload(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Upload>& upload = uploads_[digest];
  if (!upload) {
    auto writer = new_blob();
    if (!writer.ok()) {
      uploads_.erase(digest);
      return writer.error();
    }
    upload = std::make_shared<Upload>();
    upload->writer = std::move(writer).value();
  }
  return upload;
}

void ContentStore::end_upload(const Digest& digest, Upload& upload) {
  upload.is_over = true;
  upload.writer.reset();
  const std::lock_guard lock(mutex_);
  const auto found = uploads_.find(digest);
  if (found != uploads_.end() && found->second.get() == &upload) uploads_.erase(found);
}

Result<std::uint64_t> ContentStore::append_upload(const Digest& digest, std::uint64_t offset,
                                                  std::span<const std::byte> bytes) {
  RADBAKE_RETURN_IF_ERROR(validate(digest));
  if (contains(digest)) return digest.size_bytes;
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Upload> upload, find_or_start_upload(digest));
  const std::lock_guard lock(upload->mutex);
  if (upload->is_over) {
    if (contains(digest)) return digest.size_bytes;
    return Error{ErrorCode::kUnavailable, "the upload of blob " + digest.sha256 + " ended: start it again"};
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
    end_upload(digest, *upload);
    return appended.error();
  }
  return end;
}

Result<void> ContentStore::finish_upload(const Digest& digest) {
  RADBAKE_RETURN_IF_ERROR(validate(digest));
  if (contains(digest)) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Upload> upload, find_or_start_upload(digest));
  const std::lock_guard lock(upload->mutex);
  if (upload->is_over) {
    if (contains(digest)) return {};
    return Error{ErrorCode::kUnavailable, "the upload of blob " + digest.sha256 + " ended: start it again"};
  }
  auto committed = commit(*upload->writer, digest);
  end_upload(digest, *upload);
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
  return {upload->writer->size(), false};
}

std::uint64_t ContentStore::upload_bytes() const {
  std::unique_lock lock(mutex_);
  const auto uploads = uploads_;
  lock.unlock();
  std::uint64_t total = 0;
  for (const auto& [digest, upload] : uploads) {
    const std::lock_guard upload_lock(upload->mutex);
    if (!upload->is_over) total += upload->writer->size();
  }
  return total;
}

Result<std::unique_ptr<BlobWriter>> ContentStore::new_blob() {
  return BlobWriter::create(folder_ / "temporary" / std::to_string(next_temporary_++));
}

Result<void> ContentStore::commit(BlobWriter& blob, const Digest& expected) {
  RADBAKE_RETURN_IF_ERROR(validate(expected));
  const std::filesystem::path name = path_of(expected);
  const std::filesystem::path shelf = name.parent_path();
  if (!std::filesystem::exists(shelf)) {
    RADBAKE_RETURN_IF_ERROR(make_folders(shelf));
    RADBAKE_RETURN_IF_ERROR(sync_folder(folder_ / "objects"));
  }
  RADBAKE_RETURN_IF_ERROR(blob.publish(expected, name));
  // Without this the name itself may vanish in a power loss.
  return sync_folder(shelf);
}

Result<FileDescriptor> ContentStore::open_blob(const Digest& digest) const {
  if (!contains(digest)) {
    return Error{ErrorCode::kNotFound, "there is no blob " + digest.sha256.substr(0, 80) + " of " +
                                           std::to_string(digest.size_bytes) + " bytes"};
  }
  return open_file(path_of(digest), O_RDONLY);
}

Result<std::string> ContentStore::read_blob(const Digest& digest) const {
  RADBAKE_ASSIGN_OR_RETURN(const FileDescriptor file, open_blob(digest));
  RADBAKE_ASSIGN_OR_RETURN(std::string bytes, read_range(file.get(), 0, digest.size_bytes, digest.sha256));
  if (bytes.size() == digest.size_bytes) return bytes;
  return Error{ErrorCode::kDataLoss, "blob " + digest.sha256 + " has lost bytes on the disk"};
}

}  // namespace radbake::store
