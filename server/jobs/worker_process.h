#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/base/result.h"
#include "server/store/file_descriptor.h"

namespace radbake::jobs {

/// Bounds that the kernel holds a worker to; 0: none. A worker never writes a core file.
struct ProcessLimits {
  std::uint64_t address_space_bytes = 0;
};

/// How a worker's process ended.
struct WorkerExit {
  bool is_clean = false;  ///< exit code 0
  std::string reason;     ///< "was killed by SIGSEGV", "exited with code 3", with its last words on stderr
};

/// A child process in a process group of its own, with nothing inherited but the descriptors named, /dev/null as input
/// and stderr (stdout too) forwarded line by line to our stderr.
class WorkerProcess {
 public:
  /// Starts a program; the inherited descriptors keep their numbers. `on_exit` is called once, from a thread of the
  /// process's own, after the process has gone.
  static Result<std::unique_ptr<WorkerProcess>> start(const std::filesystem::path& program,
                                                      const std::vector<std::string>& arguments,
                                                      std::span<const int> inherited, const ProcessLimits& limits,
                                                      std::function<void(const WorkerExit&)> on_exit);
  /// Kills the group if it still runs, and waits.
  ~WorkerProcess();

  /// Kills the whole group at once. Nothing happens if it has ended.
  void kill_group();

 private:
  WorkerProcess(pid_t pid, store::FileDescriptor output, std::function<void(const WorkerExit&)> on_exit);
  void watch();
  WorkerExit wait_for_exit();

  const pid_t pid_;
  const store::FileDescriptor output_;
  const std::function<void(const WorkerExit&)> on_exit_;
  std::string last_line_;
  std::mutex mutex_;  // guards is_reaped_: a number that was reaped may name another process
  bool is_reaped_ = false;
  std::thread thread_;
};

/// Lifts the limit on open files to what the system allows: every input of a worker is one.
void raise_open_file_limit();

}  // namespace radbake::jobs
