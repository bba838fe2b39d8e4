#include "server/jobs/ready_worker.h"

#include <sys/socket.h>

#include <array>
#include <chrono>
#include <utility>

namespace radbake::jobs {

Result<std::unique_ptr<ReadyWorker>> ReadyWorker::start(const WorkerOptions& options) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) {
    return store::system_error("cannot create a socket for a worker");
  }
  std::unique_ptr<ReadyWorker> worker(new ReadyWorker());
  worker->socket_ = store::FileDescriptor(ends[0]);
  const store::FileDescriptor theirs(ends[1]);
  std::vector<std::string> arguments = {"--fd", std::to_string(theirs.get()), "--wait"};
  if (options.log_json) arguments.emplace_back("--log-json");
  const auto on_exit = [ending = worker->ending_](const WorkerExit& exit) {
    std::unique_lock lock(ending->mutex);
    ending->has_ended = true;
    const auto told = std::move(ending->on_exit);
    lock.unlock();
    if (told) told(exit);
  };
  const std::array inherited = {theirs.get()};
  RADBAKE_ASSIGN_OR_RETURN(worker->process_,
                           WorkerProcess::start(options.program, arguments, inherited, options.limits, on_exit));
  return worker;
}

std::optional<ReadyWorker::Hired> ReadyWorker::hire(const handover::Assignment& assignment,
                                                    std::function<void(const WorkerExit&)> on_exit) {
  // One that is gone, or does not get so far, is no loss: another is started. To wait for it costs less than that.
  constexpr std::chrono::milliseconds kPatience{200};
  if (!handover::fits(assignment) || !handover::is_announced(socket_.get(), kPatience) ||
      !handover::give(socket_.get(), assignment).ok()) {
    return std::nullopt;
  }
  {
    const std::lock_guard lock(ending_->mutex);
    if (ending_->has_ended) return std::nullopt;
    ending_->on_exit = std::move(on_exit);
  }
  return Hired{std::move(process_), std::move(socket_)};
}

}  // namespace radbake::jobs
