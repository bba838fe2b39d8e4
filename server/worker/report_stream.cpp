#include "server/worker/report_stream.h"

#include <utility>

namespace radbake::worker {
namespace {

// A tile is at most 64 KiB: 4 MiB wait at most.
constexpr std::size_t kMaxQueued = 64;
constexpr std::chrono::milliseconds kProgressInterval{100};
// Every second is promised; what is written now may arrive a little later.
constexpr std::chrono::milliseconds kHeartbeatInterval{900};

}  // namespace

ReportStream::ReportStream(const std::shared_ptr<grpc::Channel>& channel, const v1::WorkerHello& hello)
    : stub_(v1::Workers::NewStub(channel)), stream_(stub_->Report(&context_)) {
  *queue_.emplace_back().mutable_hello() = hello;
  progress_.set_state(v1::PREPARING);
  progress_.set_seconds_left(-1);
  progress_written_at_ = Clock::now();
  reader_ = std::thread([this] { read_commands(); });
  writer_ = std::thread([this] { write_reports(); });
}

ReportStream::~ReportStream() {
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
    changed_.notify_all();
  }
  // Wakes both threads wherever they wait.
  context_.TryCancel();
  writer_.join();
  reader_.join();
  stream_->Finish();
}

std::optional<v1::StartWork> ReportStream::wait_for_start() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return start_ || is_gone_; });
  return start_;
}

void ReportStream::set_progress(const v1::Progress& progress) {
  const std::lock_guard lock(mutex_);
  if (has_outcome_) return;
  const bool is_new_state = progress.state() != progress_.state();
  progress_ = progress;
  if (is_new_state) {
    // States must not be skipped; there are few enough to pass the bound of the queue.
    *queue_.emplace_back().mutable_progress() = progress;
    is_progress_new_ = false;
    progress_written_at_ = Clock::now();
    changed_.notify_all();
  } else if (!std::exchange(is_progress_new_, true)) {
    changed_.notify_all();
  }
}

bool ReportStream::send(v1::WorkerReport report) {
  std::unique_lock lock(mutex_);
  return enqueue(std::move(report), lock);
}

bool ReportStream::finish(v1::WorkerReport outcome) {
  std::unique_lock lock(mutex_);
  if (!enqueue(std::move(outcome), lock)) return false;
  has_outcome_ = true;
  changed_.wait(lock, [this] { return is_accepted_ || is_gone_; });
  return is_accepted_;
}

bool ReportStream::enqueue(v1::WorkerReport report, std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [this] { return queue_.size() < kMaxQueued || is_gone_; });
  if (is_gone_) return false;
  queue_.push_back(std::move(report));
  changed_.notify_all();
  return true;
}

void ReportStream::read_commands() {
  v1::WorkerCommand command;
  while (stream_->Read(&command)) {
    if (command.has_cancel()) stop_.request_stop();
    if (command.has_finish()) finish_.request_stop();
    const std::lock_guard lock(mutex_);
    if (command.has_start()) start_ = std::move(*command.mutable_start());
    if (command.has_accepted()) is_accepted_ = true;
    changed_.notify_all();
  }
  {
    const std::lock_guard lock(mutex_);
    is_gone_ = true;
    changed_.notify_all();
  }
  stop_.request_stop();
}

std::optional<v1::WorkerReport> ReportStream::next_report() {
  std::unique_lock lock(mutex_);
  while (!is_gone_ && !is_closing_) {
    if (!queue_.empty()) {
      v1::WorkerReport report = std::move(queue_.front());
      queue_.pop_front();
      changed_.notify_all();
      return report;
    }
    if (has_outcome_) {
      changed_.wait(lock);
      continue;
    }
    const auto due = progress_written_at_ + (is_progress_new_ ? kProgressInterval : kHeartbeatInterval);
    if (Clock::now() >= due) {
      is_progress_new_ = false;
      progress_written_at_ = Clock::now();
      v1::WorkerReport report;
      *report.mutable_progress() = progress_;
      return report;
    }
    changed_.wait_until(lock, due);
  }
  return std::nullopt;
}

void ReportStream::write_reports() {
  // A write returns when the message is on its way: a server that does not read stops us here.
  while (auto report = next_report()) {
    if (!stream_->Write(*report)) return;  // the reader learns it, too
  }
}

}  // namespace radbake::worker
