#include "server/worker/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <functional>
#include <thread>

namespace radbake::worker {
namespace {

/// How a child ends that enters the sandbox and does something: its exit code, or minus the signal that killed it.
int end_of(const std::function<int()>& action) {
  const pid_t child = fork();
  if (child == 0) _exit(enter_sandbox().ok() ? action() : 99);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

constexpr int kDone = 7;

class Sandbox : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!filters_system_calls()) GTEST_SKIP() << "a sanitizer needs its system calls";
  }
};

TEST_F(Sandbox, LetsABakeCompute) {
  EXPECT_EQ(end_of([] {
              int ends[2];
              if (pipe2(ends, O_CLOEXEC) != 0) return 1;
              std::string text(10'000'000, 'x');
              std::thread([&] { text += 'y'; }).join();
              char byte = 0;
              return write(ends[1], "z", 1) == 1 && read(ends[0], &byte, 1) == 1 && byte == 'z' ? kDone : 2;
            }),
            kDone);
}

TEST_F(Sandbox, EndsWhatStartsAProcess) {
  EXPECT_EQ(end_of([] { return fork() >= 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return vfork() >= 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] {
              char name[] = "true";
              char* arguments[] = {name, nullptr};
              pid_t pid = 0;
              return posix_spawn(&pid, "/bin/true", nullptr, nullptr, arguments, nullptr) == 0 ? 1 : 2;
            }),
            -SIGSYS);
}

TEST_F(Sandbox, EndsWhatRunsAProgram) {
  EXPECT_EQ(end_of([] { return execl("/bin/true", "true", nullptr); }), -SIGSYS);
}

TEST_F(Sandbox, EndsWhatOpensASocket) {
  EXPECT_EQ(end_of([] { return socket(AF_INET, SOCK_STREAM, 0) >= 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return socket(AF_UNIX, SOCK_DGRAM, 0) >= 0 ? 1 : 2; }), -SIGSYS);
}

TEST_F(Sandbox, EndsWhatWritesAFile) {
  EXPECT_EQ(end_of([] { return open("/tmp/radbake-sandbox-test", O_WRONLY | O_CREAT, 0600) >= 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return open("/dev/null", O_RDWR) >= 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return unlink("/tmp/radbake-sandbox-test") == 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return mkdir("/tmp/radbake-sandbox-test", 0700) == 0 ? 1 : 2; }), -SIGSYS);
}

TEST_F(Sandbox, FindsNoFiles) {
  EXPECT_EQ(end_of([] { return open("/etc/passwd", O_RDONLY) < 0 && errno == ENOENT ? kDone : 1; }), kDone);
  EXPECT_EQ(end_of([] {
              struct stat facts {};
              return stat("/etc/passwd", &facts) != 0 && errno == ENOENT ? kDone : 1;
            }),
            kDone);
}

TEST_F(Sandbox, LetsNoOpenFileGrow) {
  FILE* file = tmpfile();
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(end_of([&] { return write(fileno(file), "x", 1) < 0 && errno == EFBIG ? kDone : 1; }), kDone);
  fclose(file);
}

TEST_F(Sandbox, LetsDescriptorsNotGrowWithoutEnd) {
  EXPECT_EQ(end_of([] {
              for (int i = 0; i < 5000; ++i) {
                if (dup(0) < 0) return errno == EMFILE && i > 200 ? kDone : 1;
              }
              return 2;
            }),
            kDone);
}

TEST_F(Sandbox, EndsWhatReachesForOtherProcesses) {
  EXPECT_EQ(end_of([] { return kill(getppid(), 0) == 0 ? 1 : 2; }), -SIGSYS);
  EXPECT_EQ(end_of([] { return ptrace(PTRACE_ATTACH, getppid(), nullptr, nullptr) == 0 ? 1 : 2; }), -SIGSYS);
}

TEST_F(Sandbox, BindsThreadsThatRanBefore) {
  const pid_t child = fork();
  if (child == 0) {
    int gate[2];
    if (pipe(gate) != 0) _exit(1);
    std::thread before([&] {
      char byte = 0;
      (void)!read(gate[0], &byte, 1);
      socket(AF_INET, SOCK_STREAM, 0);
    });
    if (!enter_sandbox().ok()) _exit(2);
    (void)!write(gate[1], "g", 1);
    before.join();
    _exit(3);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
  EXPECT_EQ(WTERMSIG(status), SIGSYS);
}

TEST_F(Sandbox, LetsAProgramAbort) {
  EXPECT_EQ(end_of([]() -> int { abort(); }), -SIGABRT);
}

TEST_F(Sandbox, SeesTheSameProcessors) {
  const unsigned outside = std::thread::hardware_concurrency();
  EXPECT_EQ(end_of([&] { return std::thread::hardware_concurrency() == outside ? kDone : 1; }), kDone);
}

}  // namespace
}  // namespace radbake::worker
