// What is there, and what goes.

#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "server/store/content_store.h"

namespace radbake::store {
namespace {

using std::chrono::system_clock;

system_clock::time_point time_of(const struct stat& facts) {
  return system_clock::time_point(std::chrono::seconds(facts.st_mtim.tv_sec));
}

/// The blob that a temporary file is a part of.
std::optional<Digest> uploaded_blob(const std::string& file_name, std::string_view prefix) {
  if (!file_name.starts_with(prefix)) return std::nullopt;
  const std::size_t dash = file_name.rfind('-');
  if (dash <= prefix.size()) return std::nullopt;
  Digest digest{file_name.substr(prefix.size(), dash - prefix.size()), 0};
  const char* end = file_name.data() + file_name.size();
  const auto [stop, problem] = std::from_chars(file_name.data() + dash + 1, end, digest.size_bytes);
  if (problem != std::errc() || stop != end || !validate_sha256(digest.sha256).ok()) return std::nullopt;
  return digest;
}

Result<std::vector<std::filesystem::path>> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code reason;
  std::filesystem::directory_iterator file(folder, reason);
  for (; !reason && file != std::filesystem::directory_iterator(); file.increment(reason))
    files.push_back(file->path());
  if (reason) return internal_error("cannot read " + folder.string() + ": " + reason.message());
  return files;
}

}  // namespace

Result<void> ContentStore::take_stock_of_uploads() {
  RADBAKE_ASSIGN_OR_RETURN(const auto files, files_in(folder_ / "temporary"));
  for (const std::filesystem::path& file : files) {
    const std::optional<Digest> digest = uploaded_blob(file.filename().string(), kUploadPrefix);
    struct stat facts {};
    if (digest && validate(*digest).ok() && !contains(*digest) && ::stat(file.c_str(), &facts) == 0) {
      const auto upload = uploads_[*digest] = std::make_shared<Upload>();
      upload->used_at = std::chrono::steady_clock::now();
      upload->num_bytes = static_cast<std::uint64_t>(facts.st_size);
      reserved_bytes_ += digest->size_bytes;
    } else if (::unlink(file.c_str()) != 0) {
      return system_error("cannot remove " + file.string());
    }
  }
  return {};
}

/// Counts what is there, removes results that a server that was killed left half-written, and finds its uploads.
Result<void> ContentStore::take_stock() {
  RADBAKE_RETURN_IF_ERROR(take_stock_of_uploads());
  RADBAKE_ASSIGN_OR_RETURN(const auto shelves, files_in(folder_ / "objects"));
  for (const std::filesystem::path& shelf : shelves) {
    RADBAKE_ASSIGN_OR_RETURN(const auto files, files_in(shelf));
    for (const std::filesystem::path& file : files) {
      struct stat facts {};
      if (::stat(file.c_str(), &facts) == 0) object_bytes_ += static_cast<std::uint64_t>(facts.st_size);
    }
    shelves_.insert(shelf);
  }
  // A server that was killed may have made a folder without that.
  for (const std::filesystem::path& folder : {folder_ / "objects", folder_, folder_.parent_path()}) {
    RADBAKE_RETURN_IF_ERROR(sync_folder(folder, folder.string()));
  }
  return {};
}

void ContentStore::remove(const Digest& digest) {
  const std::unique_lock lock(sweeping_);
  if (::unlink(path_of(digest).c_str()) != 0) return;
  const std::lock_guard counting(mutex_);
  object_bytes_ -= digest.size_bytes;
}

std::uint64_t ContentStore::upload_bytes() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t total = 0;
  for (const auto& [digest, upload] : uploads_) total += upload->num_bytes;
  return total;
}

std::uint64_t ContentStore::used_bytes() const {
  const std::lock_guard lock(mutex_);
  return object_bytes_ + reserved_bytes_;
}

Result<std::uint64_t> ContentStore::sweep(const std::set<Digest>& needed, system_clock::time_point unused_since,
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
  RADBAKE_ASSIGN_OR_RETURN(const auto shelves, files_in(folder_ / "objects"));
  for (const std::filesystem::path& shelf : shelves) {
    RADBAKE_ASSIGN_OR_RETURN(const auto files, files_in(shelf));
    for (const std::filesystem::path& file : files) {
      struct stat facts {};
      if (::stat(file.c_str(), &facts) != 0) continue;
      const Digest digest{file.filename().string(), static_cast<std::uint64_t>(facts.st_size)};
      if (time_of(facts) < unused_since && !needed.contains(digest)) candidates.push_back({time_of(facts), digest});
    }
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
