#include "client/api/private_server.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace radbake::api {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollInterval{10};
constexpr std::streamoff kLogTailBytes = 1500;
/// sockaddr_un::sun_path with its terminating zero.
constexpr std::size_t kMaxSocketPath = 107;

Error unavailable(std::string message) { return {ErrorCode::kUnavailable, std::move(message)}; }
std::string reason(int error) { return std::generic_category().message(error); }

Result<fs::path> make_private_folder() {
  std::error_code failure;
  const fs::path parent = fs::temp_directory_path(failure);
  if (failure) return unavailable("no folder for temporary files: " + failure.message());
  std::string path = (parent / "radbake-XXXXXX").string();
  // mkdtemp makes it with mode 0700.
  if (!mkdtemp(path.data())) return unavailable("cannot make a folder in " + parent.string() + ": " + reason(errno));
  return fs::path(path);
}

Result<fs::path> program_beside_us() {
  std::error_code failure;
  const fs::path self = fs::read_symlink("/proc/self/exe", failure);
  if (failure) return unavailable("cannot find the running program: " + failure.message());
  const fs::path program = self.parent_path() / "radbaked";
  if (!fs::exists(program, failure)) {
    return unavailable("no radbaked beside " + self.string() + ": install it there, or name a server with --server");
  }
  return program;
}

}  // namespace

Result<PrivateServer> PrivateServer::start(const Options& options) {
  PrivateServer server;
  server.options_ = options;
  if (options.program.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(server.options_.program, program_beside_us());
  }
  RADBAKE_ASSIGN_OR_RETURN(server.folder_, make_private_folder());
  if ((server.folder_ / "socket").string().size() > kMaxSocketPath) {
    return unavailable("the path of the folder for temporary files is too long for a socket: " +
                       server.folder_.string() + "; set TMPDIR to a shorter one");
  }
  RADBAKE_RETURN_IF_ERROR(server.launch());
  RADBAKE_RETURN_IF_ERROR(server.wait_until_listening());
  return server;
}

PrivateServer::PrivateServer(PrivateServer&& other) noexcept
    : options_(std::move(other.options_)),
      folder_(std::exchange(other.folder_, {})),
      pid_(std::exchange(other.pid_, -1)),
      output_(std::exchange(other.output_, -1)) {}

PrivateServer::~PrivateServer() {
  stop();
  if (output_ >= 0) close(output_);
  std::error_code ignored;  // nobody is left to tell, and the folder is in /tmp
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

std::string PrivateServer::address() const { return "unix:" + (folder_ / "socket").string(); }

Result<void> PrivateServer::launch() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return unavailable("cannot make a pipe: " + reason(errno));
  output_ = ends[0];

  // stdin: nothing; stdout: the pipe; stderr: the log.
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  const std::string log = (folder_ / "log").string();
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);

  // A group of its own, and none of the signals that we block or ignore.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::vector<std::string> arguments = {options_.program.string(),   "--listen",          address(), "--data",
                                        (folder_ / "data").string(), "--exit-with-parent"};
  if (!options_.costs.empty()) arguments.insert(arguments.end(), {"--costs", options_.costs.string()});
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const int failure = posix_spawn(&pid_, pointers[0], &files, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(ends[1]);
  if (failure == 0) return {};
  pid_ = -1;
  return unavailable("cannot start " + options_.program.string() + ": " + reason(failure));
}

Result<void> PrivateServer::wait_until_listening() {
  const std::string name = options_.program.filename().string();
  const Clock::time_point limit = Clock::now() + options_.start_limit;
  std::string output;
  while (output.find(" listening on ") == std::string::npos || output.back() != '\n') {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(limit - Clock::now());
    pollfd ready{output_, POLLIN, 0};
    const int count = left.count() > 0 ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      return unavailable(name + " did not start within " + std::to_string(options_.start_limit.count()) + " ms" +
                         log_tail());
    }
    char buffer[512];
    const ssize_t size = read(output_, buffer, sizeof buffer);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return unavailable(name + " ended before it listened" + log_tail());
    output.append(buffer, static_cast<std::size_t>(size));
  }
  return {};
}

std::string PrivateServer::log_tail() const {
  std::ifstream log(folder_ / "log", std::ios::binary | std::ios::ate);
  if (!log || log.tellg() <= 0) return "";
  const std::streamoff size = log.tellg();
  log.seekg(std::max<std::streamoff>(0, size - kLogTailBytes));
  std::string text(std::istreambuf_iterator<char>(log), {});
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return "; its log ends:\n" + text;
}

bool PrivateServer::has_exited() {
  if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) != 0) pid_ = -1;
  return pid_ < 0;
}

void PrivateServer::stop() {
  if (has_exited()) return;
  kill(pid_, SIGTERM);
  const Clock::time_point limit = Clock::now() + options_.stop_limit;
  while (!has_exited()) {
    if (Clock::now() > limit) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      pid_ = -1;
      return;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

}  // namespace radbake::api
