#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/handover/handover.h"
#include "server/jobs/worker_process.h"
#include "server/jobs/worker_run.h"
#include "server/store/file_descriptor.h"

namespace radbake::jobs {

/// A worker's process and the server's end of its socket.
struct StartedWorker {
  std::unique_ptr<WorkerProcess> process;
  store::FileDescriptor socket;
};

/// Starts a process that is told the number of its socket, `arguments` beside that, and inherits descriptors. Errors:
/// kUnavailable: the system starts none now.
Result<StartedWorker> start_worker(const WorkerOptions& options, const std::vector<std::string>& arguments,
                                   std::vector<int> inherited, std::function<void(const WorkerExit&)> on_exit);

/// A worker that was started ahead of need: it has loaded its libraries and waits to be told its job.
class ReadyWorker {
 public:
  static Result<std::unique_ptr<ReadyWorker>> start(const WorkerOptions& options);
  /// Kills it, unless it was hired.
  ~ReadyWorker() = default;

  /// Gives it a job; `on_exit` is called once when it has ended. Empty if it is gone or the job does not fit: nothing
  /// is called then. Call once.
  std::optional<StartedWorker> hire(const handover::Assignment& assignment,
                                    std::function<void(const WorkerExit&)> on_exit);

 private:
  /// Shared with the process's own thread.
  struct Ending {
    std::mutex mutex;
    bool has_ended = false;
    std::function<void(const WorkerExit&)> on_exit;
  };

  ReadyWorker() = default;

  std::shared_ptr<Ending> ending_ = std::make_shared<Ending>();
  StartedWorker worker_;
};

}  // namespace radbake::jobs
