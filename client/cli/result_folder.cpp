#include "client/cli/result_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace radbake::cli {
namespace {

namespace fs = std::filesystem;

/// Brings a file's or folder's content to the disk, so that a name never outlives a power loss that its bytes did not.
Result<void> flush_to_disk(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  int failure = fd < 0 || fsync(fd) != 0 ? errno : 0;
  if (fd >= 0) close(fd);
  std::error_code ignored;
  // Some file systems cannot do it for a folder, and some folders may be written to and not read.
  if ((failure == EINVAL || failure == ENOTSUP || failure == EACCES) && fs::is_directory(path, ignored)) failure = 0;
  if (failure == 0) return {};
  return internal_error("cannot bring " + path.string() + " to the disk: " + std::generic_category().message(failure));
}

Error cannot(const std::string& what, const fs::path& path, const std::error_code& failure) {
  return invalid_argument("cannot " + what + " " + path.string() + ": " + failure.message());
}

}  // namespace

Result<ResultFolder> ResultFolder::open(const fs::path& folder, bool force) {
  ResultFolder result;
  std::error_code failure;
  // "baked/" names the folder "baked".
  result.folder_ = fs::absolute(folder, failure).lexically_normal();
  if (!result.folder_.has_filename()) result.folder_ = result.folder_.parent_path();
  const fs::file_status status = fs::status(result.folder_, failure);
  result.existed_ = fs::exists(status);
  if (result.existed_) {
    if (!fs::is_directory(status)) return invalid_argument(folder.string() + " is not a folder");
    const bool is_empty = fs::is_empty(result.folder_, failure);
    if (failure) return cannot("read folder", folder, failure);
    if (!is_empty && !force) {
      return invalid_argument("folder " + folder.string() + " is not empty; --force writes to it all the same");
    }
  } else {
    fs::create_directories(result.folder_.parent_path(), failure);
    if (failure) return cannot("make folder", result.folder_.parent_path(), failure);
  }

  // In the same file system as the folder, or else a rename would copy.
  std::string pattern = (result.existed_ ? result.folder_ / ".radbake" : result.folder_).string() + ".tmp-XXXXXX";
  if (!mkdtemp(pattern.data())) return cannot("write to", folder, {errno, std::generic_category()});
  result.building_ = pattern;
  // mkdtemp makes folders that nobody else can read; the results are as readable as any file.
  const mode_t mask = umask(0);
  umask(mask);
  chmod(result.building_.c_str(), 0777 & ~mask);
  return result;
}

ResultFolder::ResultFolder(ResultFolder&& other) noexcept
    : folder_(std::move(other.folder_)), building_(std::exchange(other.building_, {})), existed_(other.existed_) {}

ResultFolder::~ResultFolder() {
  std::error_code ignored;
  if (!building_.empty()) fs::remove_all(building_, ignored);
}

Result<void> ResultFolder::publish() {
  std::error_code failure;
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(building_, failure)) {
    names.push_back(entry.path().filename());
    RADBAKE_RETURN_IF_ERROR(flush_to_disk(entry.path()));
  }
  if (failure) return internal_error("cannot read " + building_.string() + ": " + failure.message());
  RADBAKE_RETURN_IF_ERROR(flush_to_disk(building_));
  if (!existed_) {
    fs::rename(building_, folder_, failure);
    if (failure) return internal_error("cannot write " + folder_.string() + ": " + failure.message());
  } else {
    // The report goes first and comes last, on the disk too.
    std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
      return std::pair(a == kReportName, a) < std::pair(b == kReportName, b);
    });
    fs::remove(folder_ / kReportName, failure);
    RADBAKE_RETURN_IF_ERROR(flush_to_disk(folder_));
    for (const std::string& name : names) {
      if (name == kReportName) RADBAKE_RETURN_IF_ERROR(flush_to_disk(folder_));
      fs::rename(building_ / name, folder_ / name, failure);
      if (failure) return internal_error("cannot write " + (folder_ / name).string() + ": " + failure.message());
    }
    fs::remove(building_, failure);
    RADBAKE_RETURN_IF_ERROR(flush_to_disk(folder_));
  }
  building_.clear();
  return flush_to_disk(folder_.parent_path());
}

}  // namespace radbake::cli
