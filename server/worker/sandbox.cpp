#include "server/worker/sandbox.h"

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <type_traits>

namespace radbake::worker {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

// What a bake does: compute on threads, and talk over what is open.
constexpr int kAllowed[] = {
    // Memory.
    SCMP_SYS(brk), SCMP_SYS(mmap), SCMP_SYS(mprotect), SCMP_SYS(mremap), SCMP_SYS(munmap), SCMP_SYS(madvise),
    SCMP_SYS(mincore), SCMP_SYS(membarrier),
    // Threads; clone() is below.
    SCMP_SYS(futex), SCMP_SYS(set_robust_list), SCMP_SYS(get_robust_list), SCMP_SYS(rseq), SCMP_SYS(set_tid_address),
    SCMP_SYS(gettid), SCMP_SYS(getpid), SCMP_SYS(getppid), SCMP_SYS(exit), SCMP_SYS(exit_group), SCMP_SYS(sched_yield),
    SCMP_SYS(sched_getaffinity), SCMP_SYS(sched_setaffinity), SCMP_SYS(sched_getparam), SCMP_SYS(sched_getscheduler),
    SCMP_SYS(getcpu), SCMP_SYS(arch_prctl), SCMP_SYS(restart_syscall),
    // Clocks.
    SCMP_SYS(clock_gettime), SCMP_SYS(clock_getres), SCMP_SYS(clock_nanosleep), SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday), SCMP_SYS(time), SCMP_SYS(times),
    // Signals to itself; tgkill() is below.
    SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(sigaltstack),
    // Descriptors that are open.
    SCMP_SYS(read), SCMP_SYS(readv), SCMP_SYS(pread64), SCMP_SYS(preadv), SCMP_SYS(write), SCMP_SYS(writev),
    SCMP_SYS(lseek), SCMP_SYS(close), SCMP_SYS(fstat), SCMP_SYS(dup), SCMP_SYS(fcntl), SCMP_SYS(recvmsg),
    SCMP_SYS(sendmsg), SCMP_SYS(recvfrom), SCMP_SYS(shutdown), SCMP_SYS(getsockname), SCMP_SYS(getpeername),
    SCMP_SYS(getsockopt), SCMP_SYS(setsockopt), SCMP_SYS(poll), SCMP_SYS(ppoll), SCMP_SYS(select), SCMP_SYS(pselect6),
    SCMP_SYS(epoll_create1), SCMP_SYS(epoll_ctl), SCMP_SYS(epoll_wait), SCMP_SYS(epoll_pwait), SCMP_SYS(eventfd2),
    SCMP_SYS(pipe2), SCMP_SYS(timerfd_create), SCMP_SYS(timerfd_settime), SCMP_SYS(timerfd_gettime),
    // About itself and the machine.
    SCMP_SYS(getrusage), SCMP_SYS(getrandom), SCMP_SYS(uname), SCMP_SYS(sysinfo), SCMP_SYS(getuid), SCMP_SYS(geteuid),
    SCMP_SYS(getgid), SCMP_SYS(getegid)};

// What libraries try and can do without, and what they are told.
struct Refused {
  int call;
  int error;
};
constexpr Refused kRefused[] = {
    // There are no files: TBB asks for the machine's, OpenSSL for its settings.
    {SCMP_SYS(access), ENOENT},
    {SCMP_SYS(faccessat), ENOENT},
    {SCMP_SYS(faccessat2), ENOENT},
    {SCMP_SYS(stat), ENOENT},
    {SCMP_SYS(lstat), ENOENT},
    {SCMP_SYS(statx), ENOENT},
    {SCMP_SYS(readlink), ENOENT},
    {SCMP_SYS(readlinkat), ENOENT},
    {SCMP_SYS(getcwd), ENOENT},
    {SCMP_SYS(ioctl), ENOTTY},
    // Its flags lie in memory, where a filter does not look; the C library then takes clone().
    {SCMP_SYS(clone3), ENOSYS},
    {SCMP_SYS(get_mempolicy), ENOSYS},
    {SCMP_SYS(mbind), ENOSYS},
    {SCMP_SYS(set_mempolicy), ENOSYS},
};

Error refused(const std::string& what, int error) {
  return internal_error("the worker's sandbox: " + what + ": " + std::generic_category().message(error));
}

rlim_t highest_descriptor() {
  rlim_t highest = 0;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", ignored)) {
    highest = std::max<rlim_t>(highest, std::strtoul(entry.path().filename().c_str(), nullptr, 10));
  }
  return highest;
}

/// Builds the filter and puts it on all threads; 0 or a negative errno.
int load_filter() {
  const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, decltype(&seccomp_release)> filter(
      seccomp_init(SCMP_ACT_KILL_PROCESS), &seccomp_release);
  if (!filter) return -ENOMEM;
  int problem = seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_TSYNC, 1);
  const auto add = [&](std::uint32_t action, int call, std::initializer_list<scmp_arg_cmp> conditions = {}) {
    if (problem == 0) {
      problem = seccomp_rule_add_array(filter.get(), action, call, static_cast<unsigned>(conditions.size()),
                                       conditions.begin());
    }
  };
  for (const int call : kAllowed) add(SCMP_ACT_ALLOW, call);
  for (const auto& [call, error] : kRefused) add(SCMP_ACT_ERRNO(static_cast<unsigned>(error)), call);

  // A new thread, never a new process.
  add(SCMP_ACT_ALLOW, SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD)});
  // abort() and raise(): signals to this process.
  const auto pid = static_cast<scmp_datum_t>(::getpid());
  add(SCMP_ACT_ALLOW, SCMP_SYS(tgkill), {SCMP_A0(SCMP_CMP_EQ, pid)});
  add(SCMP_ACT_ALLOW, SCMP_SYS(prctl), {SCMP_A0(SCMP_CMP_EQ, PR_SET_NAME)});
  add(SCMP_ACT_ALLOW, SCMP_SYS(prctl), {SCMP_A0(SCMP_CMP_EQ, PR_SET_VMA)});
  // Limits may be read.
  add(SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), {SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A2(SCMP_CMP_EQ, 0)});
  // A look at a descriptor; a path is not found.
  add(SCMP_ACT_ALLOW, SCMP_SYS(newfstatat), {SCMP_A3(SCMP_CMP_MASKED_EQ, AT_EMPTY_PATH, AT_EMPTY_PATH)});
  add(SCMP_ACT_ERRNO(ENOENT), SCMP_SYS(newfstatat), {SCMP_A3(SCMP_CMP_MASKED_EQ, AT_EMPTY_PATH, 0)});
  // What would be read is not there; what would be written ends the process.
  constexpr scmp_datum_t kWrites = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC;
  add(SCMP_ACT_ERRNO(ENOENT), SCMP_SYS(openat), {SCMP_A2(SCMP_CMP_MASKED_EQ, kWrites, 0)});
  add(SCMP_ACT_ERRNO(ENOENT), SCMP_SYS(open), {SCMP_A1(SCMP_CMP_MASKED_EQ, kWrites, 0)});
  return problem == 0 ? seccomp_load(filter.get()) : problem;
}

}  // namespace

bool filters_system_calls() { return !kIsSanitized; }

Result<void> enter_sandbox() {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return refused("no new privileges", errno);
  // No file may grow: results go over the socket. A log that goes to a file is lost, its writer is not.
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit nothing{0, 0};
  if (::setrlimit(RLIMIT_FSIZE, &nothing) != 0) return refused("a limit of 0 on the size of files", errno);
  // Room beside what is open for gRPC's own and for the inputs of a job that is handed over.
  constexpr rlim_t kMoreDescriptors = 512;
  const rlim_t most = highest_descriptor() + kMoreDescriptors;
  rlimit open{};
  if (::getrlimit(RLIMIT_NOFILE, &open) == 0 && most < open.rlim_max) {
    open = {most, most};
    if (::setrlimit(RLIMIT_NOFILE, &open) != 0) return refused("a limit on open descriptors", errno);
  }
  if (!filters_system_calls()) return {};
  if (const int problem = load_filter(); problem != 0) return refused("the filter of system calls", -problem);
  return {};
}

}  // namespace radbake::worker
