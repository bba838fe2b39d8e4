// Preloaded into a server (LD_PRELOAD): its disk refuses what RADBAKE_DISK_FAULTS says, a file with a line
//
//   FOLDER CALL ERRNO        CALL: write, sync or name
//
// for every file below that folder. An empty or missing file: nothing is refused. What a worker inherits is not
// touched.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

const char* g_control = nullptr;

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

std::string path_of(const char* path) { return path; }
std::string path_of(int fd) {
  char path[PATH_MAX];
  const ssize_t size = ::readlink(("/proc/self/fd/" + std::to_string(fd)).c_str(), path, sizeof(path));
  return size > 0 ? std::string(path, static_cast<std::size_t>(size)) : "";
}

/// The errno that a call meets on a file, which is a path or open; 0: none.
template <typename File>
int fault(std::string_view call, File file) {
  if (g_control == nullptr) return 0;
  const int control = ::open(g_control, O_RDONLY | O_CLOEXEC);
  if (control < 0) return 0;
  char text[PATH_MAX + 64];
  const ssize_t size = ::read(control, text, sizeof(text) - 1);
  ::close(control);
  if (size <= 0) return 0;
  text[size] = '\0';
  char folder[PATH_MAX + 1], refused[16];
  int number = 0;
  if (std::sscanf(text, "%4096s %15s %d", folder, refused, &number) != 3 || call != refused) return 0;
  return path_of(file).starts_with(folder) ? number : 0;
}

template <typename Function, typename File, typename... Arguments>
auto call_or_fail(const char* name, std::string_view call, File file, Arguments... arguments) {
  using Answer = decltype(next<Function>(name)(arguments...));
  if (const int number = fault(call, file)) {
    errno = number;
    return Answer{-1};
  }
  return next<Function>(name)(arguments...);
}

__attribute__((constructor)) void take_over() {
  g_control = std::getenv("RADBAKE_DISK_FAULTS");
  ::unsetenv("LD_PRELOAD");
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* bytes, size_t size) {
  return call_or_fail<ssize_t(int, const void*, size_t)>("write", "write", fd, fd, bytes, size);
}
ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  return call_or_fail<ssize_t(int, const void*, size_t, off_t)>("pwrite", "write", fd, fd, bytes, size, offset);
}
ssize_t pwrite64(int fd, const void* bytes, size_t size, off64_t offset) {
  return call_or_fail<ssize_t(int, const void*, size_t, off64_t)>("pwrite64", "write", fd, fd, bytes, size, offset);
}
int ftruncate(int fd, off_t size) noexcept { return call_or_fail<int(int, off_t)>("ftruncate", "write", fd, fd, size); }
int ftruncate64(int fd, off64_t size) noexcept {
  return call_or_fail<int(int, off64_t)>("ftruncate64", "write", fd, fd, size);
}
int fsync(int fd) { return call_or_fail<int(int)>("fsync", "sync", fd, fd); }
int fdatasync(int fd) { return call_or_fail<int(int)>("fdatasync", "sync", fd, fd); }
int rename(const char* from, const char* to) noexcept {
  return call_or_fail<int(const char*, const char*)>("rename", "name", to, from, to);
}

}  // extern "C"
