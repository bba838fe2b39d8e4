#include "server/jobs/worker_process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace radbake::jobs {
namespace {

constexpr std::size_t kMaxLineBytes = 4096;
constexpr std::size_t kMaxReasonBytes = 400;

void set_limit(pid_t pid, __rlimit_resource resource, rlim_t value) {
  const rlimit limit{value, value};
  ::prlimit(pid, resource, &limit, nullptr);
}

std::string describe_end(const siginfo_t& facts) {
  if (facts.si_code == CLD_EXITED) return "exited with code " + std::to_string(facts.si_status);
  const char* name = sigabbrev_np(facts.si_status);
  const char* meaning = facts.si_status == SIGSYS ? " (a system call that its sandbox forbids)" : "";
  return "was killed by " + (name ? std::string("SIG") + name : "signal " + std::to_string(facts.si_status)) + meaning;
}

/// What posix_spawn needs, freed at the end.
struct SpawnSetup {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;

  SpawnSetup() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSetup() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
};

}  // namespace

Result<std::unique_ptr<WorkerProcess>> WorkerProcess::start(const std::filesystem::path& program,
                                                            const std::vector<std::string>& arguments,
                                                            std::span<const int> inherited, const ProcessLimits& limits,
                                                            std::function<void(const WorkerExit&)> on_exit) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return store::system_error("cannot create a pipe for a worker");
  store::FileDescriptor read_end(ends[0]), write_end(ends[1]);

  SpawnSetup setup;
  posix_spawn_file_actions_addopen(&setup.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&setup.actions, write_end.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&setup.actions, write_end.get(), STDERR_FILENO);
  // A dup onto itself takes close-on-exec off, in the child only.
  for (const int fd : inherited) posix_spawn_file_actions_adddup2(&setup.actions, fd, fd);
  // Our own signal settings are not the worker's.
  sigset_t none, defaults;
  sigemptyset(&none);
  sigemptyset(&defaults);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGPIPE, SIGUSR1}) sigaddset(&defaults, signal);
  posix_spawnattr_setsigmask(&setup.attributes, &none);
  posix_spawnattr_setsigdefault(&setup.attributes, &defaults);
  posix_spawnattr_setpgroup(&setup.attributes, 0);
  posix_spawnattr_setflags(&setup.attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  // What the server itself inherited without the flag (a log of whoever started it) must not go on to a worker; the
  // actions hand down what is meant for it all the same.
  ::close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  pid_t pid = 0;
  const int problem = ::posix_spawn(&pid, program.c_str(), &setup.actions, &setup.attributes, argv.data(), environ);
  if (problem != 0) {
    return internal_error("cannot start the worker " + program.string() + ": " +
                          std::generic_category().message(problem));
  }
  // The limits come after the start, and before the worker is sent anything that a client wrote.
  set_limit(pid, RLIMIT_CORE, 0);
  if (limits.address_space_bytes > 0) set_limit(pid, RLIMIT_AS, limits.address_space_bytes);
  return std::unique_ptr<WorkerProcess>(new WorkerProcess(pid, std::move(read_end), std::move(on_exit)));
}

WorkerProcess::WorkerProcess(pid_t pid, store::FileDescriptor output, std::function<void(const WorkerExit&)> on_exit)
    : pid_(pid), output_(std::move(output)), on_exit_(std::move(on_exit)) {
  thread_ = std::thread([this] { watch(); });
}

WorkerProcess::~WorkerProcess() {
  kill_group();
  thread_.join();
}

void WorkerProcess::kill_group() {
  const std::lock_guard lock(mutex_);
  if (!is_reaped_) ::kill(-pid_, SIGKILL);
}

void WorkerProcess::watch() {
  // Forward whole lines, so that those of several workers do not mix, and remember the last one. The pipe ends when
  // the process does.
  std::string line;
  char buffer[4096];
  const auto end_line = [&] {
    if (line.empty()) return;
    last_line_ = line;
    line.push_back('\n');
    (void)!::write(STDERR_FILENO, line.data(), line.size());
    line.clear();
  };
  while (true) {
    const ssize_t count = ::read(output_.get(), buffer, sizeof(buffer));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    for (ssize_t i = 0; i < count; ++i) {
      if (buffer[i] == '\n' || line.size() >= kMaxLineBytes) end_line();
      if (buffer[i] != '\n') line.push_back(buffer[i]);
    }
  }
  end_line();
  on_exit_(wait_for_exit());
}

WorkerExit WorkerProcess::wait_for_exit() {
  siginfo_t facts{};
  while (::waitid(P_PID, static_cast<id_t>(pid_), &facts, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
  {
    // Children that it may have left go too, while the number of the group is still ours.
    const std::lock_guard lock(mutex_);
    ::kill(-pid_, SIGKILL);
    ::waitid(P_PID, static_cast<id_t>(pid_), &facts, WEXITED);
    is_reaped_ = true;
  }
  WorkerExit end{facts.si_code == CLD_EXITED && facts.si_status == 0, describe_end(facts)};
  if (!end.is_clean && !last_line_.empty()) end.reason += "; its last words: " + last_line_.substr(0, kMaxReasonBytes);
  return end;
}

void raise_open_file_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace radbake::jobs
