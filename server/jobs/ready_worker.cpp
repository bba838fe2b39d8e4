#include "server/jobs/ready_worker.h"

#include <sys/socket.h>

#include <chrono>
#include <utility>

namespace radbake::jobs {

Result<StartedWorker> start_worker(const WorkerOptions& options, const std::vector<std::string>& arguments,
                                   std::vector<int> inherited, std::function<void(const WorkerExit&)> on_exit) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) {
    return Error{ErrorCode::kUnavailable, store::system_error("cannot create a socket for a worker").message};
  }
  store::FileDescriptor ours(ends[0]);
  const store::FileDescriptor theirs(ends[1]);
  inherited.push_back(theirs.get());
  std::vector<std::string> all = {"--fd", std::to_string(theirs.get())};
  all.insert(all.end(), arguments.begin(), arguments.end());
  if (options.log_json) all.emplace_back("--log-json");
  auto process = WorkerProcess::start(options.program, all, inherited, options.limits, std::move(on_exit));
  if (!process.ok()) return Error{ErrorCode::kUnavailable, process.error().message};
  return StartedWorker{std::move(process).value(), std::move(ours)};
}

Result<std::unique_ptr<ReadyWorker>> ReadyWorker::start(const WorkerOptions& options) {
  std::unique_ptr<ReadyWorker> worker(new ReadyWorker());
  const auto on_exit = [ending = worker->ending_](const WorkerExit& exit) {
    std::unique_lock lock(ending->mutex);
    ending->has_ended = true;
    const auto told = std::move(ending->on_exit);
    lock.unlock();
    if (told) told(exit);
  };
  RADBAKE_ASSIGN_OR_RETURN(worker->worker_, start_worker(options, {"--wait"}, {}, on_exit));
  return worker;
}

std::optional<StartedWorker> ReadyWorker::hire(const handover::Assignment& assignment,
                                               std::function<void(const WorkerExit&)> on_exit) {
  // One that is gone, or does not get so far, is no loss: another is started. To wait for it costs less than that.
  constexpr std::chrono::milliseconds kPatience{200};
  if (!handover::fits(assignment) || !handover::is_announced(worker_.socket.get(), kPatience) ||
      !handover::give(worker_.socket.get(), assignment).ok()) {
    return std::nullopt;
  }
  {
    const std::lock_guard lock(ending_->mutex);
    if (ending_->has_ended) return std::nullopt;
    ending_->on_exit = std::move(on_exit);
  }
  return std::move(worker_);
}

}  // namespace radbake::jobs
