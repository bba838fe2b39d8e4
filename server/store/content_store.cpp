#include "server/store/content_store.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "server/store/failpoint.h"

namespace radbake::store {
namespace {

using std::chrono::system_clock;

const char* const kUploadPrefix = "upload-";
const char* const kShelves = "the content store";  // in errors

/// Blobs' times are not set anew more often than this.
constexpr std::chrono::minutes kTouchInterval{5};

system_clock::time_point time_of(const struct stat& facts) {
  return system_clock::time_point(std::chrono::seconds(facts.st_mtim.tv_sec));
}

void touch(const std::filesystem::path& path) { ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0); }

/// The blob that a temporary file is a part of.
std::optional<Digest> uploaded_blob(const std::string& file_name) {
  const std::string_view prefix = kUploadPrefix;
  if (!file_name.starts_with(prefix)) return std::nullopt;
  const std::size_t dash = file_name.rfind('-');
  if (dash <= prefix.size()) return std::nullopt;
  Digest digest{file_name.substr(prefix.size(), dash - prefix.size()), 0};
  const char* end = file_name.data() + file_name.size();
  const auto [stop, problem] = std::from_chars(file_name.data() + dash + 1, end, digest.size_bytes);
  if (problem != std::errc() || stop != end || !validate_sha256(digest.sha256).ok()) return std::nullopt;
  return digest;
}

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

/// Counts what is there, removes results that a server that was killed left half-written, and finds its uploads.
Result<void> ContentStore::take_stock() {
  std::error_code reason;
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "temporary", reason)) {
    const std::optional<Digest> digest = uploaded_blob(file.path().filename().string());
    if (digest && validate(*digest).ok() && !contains(*digest)) {
      uploads_[*digest] = std::make_shared<Upload>();
      uploads_[*digest]->used_at = std::chrono::steady_clock::now();
      reserved_bytes_ += digest->size_bytes;
    } else if (::unlink(file.path().c_str()) != 0) {
      return system_error("cannot remove " + file.path().string());
    }
  }
  if (reason) return internal_error("cannot read " + (folder_ / "temporary").string() + ": " + reason.message());
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "objects", reason)) {
    if (file.is_regular_file()) object_bytes_ += file.file_size();
  }
  if (reason) return internal_error("cannot read " + (folder_ / "objects").string() + ": " + reason.message());
  return {};
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
  if (system_clock::now() - time_of(facts) > kTouchInterval) touch(path);
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
    end_upload(digest, *upload);
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
    return upload_has_ended(digest);
  }
  Result<void> committed = wake_upload(digest, *upload);
  if (committed.ok()) committed = commit(*upload->writer, digest);
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
  if (upload->writer) return {upload->writer->size(), false};
  struct stat facts {};
  if (::stat(upload_path(digest).c_str(), &facts) != 0) return {};
  return {static_cast<std::uint64_t>(facts.st_size), false};
}

std::uint64_t ContentStore::upload_bytes() const {
  std::unique_lock lock(mutex_);
  const auto uploads = uploads_;
  lock.unlock();
  std::uint64_t total = 0;
  for (const auto& [digest, upload] : uploads) {
    const std::lock_guard upload_lock(upload->mutex);
    if (upload->is_over) continue;
    struct stat facts {};
    if (upload->writer) {
      total += upload->writer->size();
    } else if (::stat(upload_path(digest).c_str(), &facts) == 0) {
      total += static_cast<std::uint64_t>(facts.st_size);
    }
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
    RADBAKE_RETURN_IF_ERROR(make_folders(shelf, kShelves));
    RADBAKE_RETURN_IF_ERROR(sync_folder(folder_ / "objects", kShelves));
  }
  {
    const std::shared_lock lock(sweeping_);
    const bool is_new = !std::filesystem::exists(name);
    RADBAKE_RETURN_IF_ERROR(blob.publish(expected, name));
    const std::lock_guard counting(mutex_);
    if (is_new) object_bytes_ += expected.size_bytes;
  }
  failpoint("content.renamed");
  // Without this the name itself may vanish in a power loss.
  RADBAKE_RETURN_IF_ERROR(sync_folder(shelf, kShelves));
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

std::uint64_t ContentStore::used_bytes() const {
  const std::lock_guard lock(mutex_);
  return object_bytes_ + reserved_bytes_;
}

std::uint64_t ContentStore::sweep(const std::set<Digest>& needed, system_clock::time_point unused_since,
                                  std::uint64_t bytes) {
  // Uploads that nobody goes on with.
  std::vector<std::pair<Digest, std::shared_ptr<Upload>>> uploads;
  {
    const std::lock_guard lock(mutex_);
    uploads.assign(uploads_.begin(), uploads_.end());
  }
  std::uint64_t freed = 0;
  for (const auto& [digest, upload] : uploads) {
    const std::lock_guard lock(upload->mutex);
    struct stat facts {};
    const bool has_file = ::stat(upload_path(digest).c_str(), &facts) == 0;
    if (upload->is_over || upload->writer || (has_file && time_of(facts) >= unused_since)) continue;
    end_upload(digest, *upload);
    freed += digest.size_bytes;
  }

  // Blobs, the oldest first.
  struct Candidate {
    system_clock::time_point used_at;
    Digest digest;
  };
  std::vector<Candidate> candidates;
  std::error_code reason;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "objects", reason)) {
    struct stat facts {};
    if (!file.is_regular_file() || ::stat(file.path().c_str(), &facts) != 0) continue;
    const Digest digest{file.path().filename().string(), static_cast<std::uint64_t>(facts.st_size)};
    if (time_of(facts) < unused_since && !needed.contains(digest)) candidates.push_back({time_of(facts), digest});
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.used_at < b.used_at; });
  for (const Candidate& candidate : candidates) {
    if (freed >= bytes) break;
    const std::filesystem::path path = path_of(candidate.digest);
    const std::unique_lock lock(sweeping_);
    // Somebody may have asked for it meanwhile.
    struct stat facts {};
    if (::stat(path.c_str(), &facts) != 0 || time_of(facts) >= unused_since || ::unlink(path.c_str()) != 0) continue;
    freed += candidate.digest.size_bytes;
    const std::lock_guard counting(mutex_);
    object_bytes_ -= candidate.digest.size_bytes;
  }
  return freed;
}

void ContentStore::close_resting_uploads(std::chrono::steady_clock::time_point since) {
  const std::lock_guard lock(mutex_);
  for (const auto& [digest, upload] : uploads_) {
    const std::unique_lock own(upload->mutex, std::try_to_lock);
    if (!own.owns_lock() || !upload->writer || upload->used_at >= since) continue;
    upload->writer->keep();
    upload->writer.reset();
  }
}

Result<void> ContentStore::probe() {
  const std::string bytes(4096, 'p');
  RADBAKE_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> blob, new_blob());
  RADBAKE_RETURN_IF_ERROR(blob->append(std::as_bytes(std::span(bytes))));
  return blob->force();
}

}  // namespace radbake::store
