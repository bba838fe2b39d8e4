#include "server/store/file_descriptor.h"

#include <fcntl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "server/store/failpoint.h"

namespace radbake::store {
namespace {

Error error_of(const std::string& what, const std::error_code& reason) {
  ErrorCode code = ErrorCode::kInternal;
  if (reason.value() == ENOSPC || reason.value() == EDQUOT) code = ErrorCode::kResourceExhausted;
  if (reason.value() == ENOENT) code = ErrorCode::kNotFound;
  constexpr std::array kWantsOfTheMoment = {EMFILE, ENFILE, EAGAIN, ENOMEM};
  if (std::ranges::find(kWantsOfTheMoment, reason.value()) != kWantsOfTheMoment.end()) code = ErrorCode::kUnavailable;
  return {code, what + ": " + reason.message()};
}

}  // namespace

Error system_error(const std::string& what) { return error_of(what, {errno, std::system_category()}); }

Result<FileDescriptor> open_file(const std::filesystem::path& path, int flags) {
  return open_file(path, flags, path.string());
}

Result<FileDescriptor> open_file(const std::filesystem::path& path, int flags, const std::string& name) {
  FileDescriptor file(::open(path.c_str(), flags | O_CLOEXEC, 0600));
  if (!file.is_open()) return system_error("cannot open " + name);
  return file;
}

Result<void> write_all(int fd, std::span<const std::byte> bytes, std::uint64_t offset, const std::string& name) {
  if ((errno = fault("write")) != 0) return system_error("cannot write " + name);
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return system_error("cannot write " + name);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return {};
}

Result<std::string> read_range(int fd, std::uint64_t offset, std::uint64_t limit, const std::string& name) {
  std::string bytes(limit, '\0');
  std::size_t size = 0;
  while (size < limit) {
    const ssize_t count = ::pread(fd, bytes.data() + size, limit - size, static_cast<off_t>(offset + size));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_error("cannot read " + name);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  bytes.resize(size);
  return bytes;
}

Result<void> sync(int fd, const std::string& name) {
  if ((errno = fault("sync")) != 0 || ::fsync(fd) != 0) return system_error("cannot force " + name + " to the disk");
  return {};
}

Result<void> sync_folder(const std::filesystem::path& folder, const std::string& name) {
  RADBAKE_ASSIGN_OR_RETURN(const FileDescriptor file, open_file(folder, O_RDONLY | O_DIRECTORY, name));
  return sync(file.get(), name);
}

Result<void> make_folders(const std::filesystem::path& folder, const std::string& name) {
  std::error_code reason;
  std::filesystem::create_directories(folder, reason);
  if (reason) return error_of("cannot create the folder of " + name, reason);
  return {};
}

}  // namespace radbake::store
