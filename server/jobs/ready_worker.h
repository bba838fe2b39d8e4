#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "common/base/result.h"
#include "server/handover/handover.h"
#include "server/jobs/worker_process.h"
#include "server/jobs/worker_run.h"
#include "server/store/file_descriptor.h"

namespace radbake::jobs {

/// A worker that was started ahead of need: it has loaded its libraries and waits to be told its job.
class ReadyWorker {
 public:
  static Result<std::unique_ptr<ReadyWorker>> start(const WorkerOptions& options);
  /// Kills it, unless it was hired.
  ~ReadyWorker() = default;

  struct Hired {
    std::unique_ptr<WorkerProcess> process;
    store::FileDescriptor socket;  ///< the server's end
  };
  /// Gives it a job; `on_exit` is called once when it has ended. Empty if it is gone or the job does not fit: nothing
  /// is called then. Call once.
  std::optional<Hired> hire(const handover::Assignment& assignment, std::function<void(const WorkerExit&)> on_exit);

 private:
  /// Shared with the process's own thread.
  struct Ending {
    std::mutex mutex;
    bool has_ended = false;
    std::function<void(const WorkerExit&)> on_exit;
  };

  ReadyWorker() = default;

  std::shared_ptr<Ending> ending_ = std::make_shared<Ending>();
  store::FileDescriptor socket_;
  std::unique_ptr<WorkerProcess> process_;
};

}  // namespace radbake::jobs
