#include "server/service/watch_reactor.h"

#include <utility>

#include "server/service/convert.h"
#include "server/service/status.h"
#include "server/service/visible_job.h"

namespace radbake::service {

WatchReactor* WatchReactor::start(const Admission& admission, CallSlots::Slot slot, jobs::JobQueue& queue,
                                  store::TaskPool& pool, v1::WatchBakeRequest request) {
  const std::shared_ptr<WatchReactor> reactor(
      new WatchReactor(admission.caller, std::move(slot), queue, pool, std::move(request)));
  reactor->self_ = reactor;
  if (!admission.status.ok()) {
    reactor->finish(admission.status);
  } else {
    pool.post([reactor] { reactor->open(); });
  }
  return reactor.get();
}

WatchReactor::WatchReactor(access::Caller caller, CallSlots::Slot slot, jobs::JobQueue& queue, store::TaskPool& pool,
                           v1::WatchBakeRequest request)
    : slot_(std::move(slot)),
      queue_(queue),
      pool_(pool),
      caller_(std::move(caller)),
      request_(std::move(request)),
      last_sequence_(request_.after_sequence()) {}

void WatchReactor::open() {
  auto job = find_visible(queue_, caller_, request_.name());
  if (!job.ok()) return finish(to_status(job.error()));
  {
    const std::lock_guard lock(mutex_);
    job_ = std::move(job).value();
    // The job calls this while it is locked: schedule only. OnDone unsubscribes, so `this` outlives every call.
    subscription_ = job_->subscribe([this] { schedule_step(); });
  }
  step();
}

void WatchReactor::schedule_step() {
  if (!is_scheduled_.exchange(true)) pool_.post([self = shared_from_this()] { self->step(); });
}

void WatchReactor::OnWriteDone(bool ok) {
  if (!ok) is_cancelled_ = true;
  {
    const std::lock_guard lock(mutex_);
    is_writing_ = false;
  }
  schedule_step();
}

void WatchReactor::OnCancel() {
  is_cancelled_ = true;
  schedule_step();
}

void WatchReactor::OnDone() {
  if (job_) job_->unsubscribe(subscription_);
  const auto last = std::move(self_);  // may delete this
}

void WatchReactor::finish(const grpc::Status& status) {
  is_finished_ = true;
  slot_.give_back();
  Finish(status);
}

void WatchReactor::step() {
  is_scheduled_ = false;
  const std::lock_guard lock(mutex_);
  if (!job_ || is_writing_ || is_finished_) return;
  if (is_cancelled_) return finish(grpc::Status(grpc::StatusCode::CANCELLED, "the watcher has gone"));
  // The server's end comes first: a slow reader must not hold it up.
  if (job_->is_closing())
    return finish(to_status({ErrorCode::kUnavailable, "the server is stopping: watch again later"}));
  const auto has_message = next_message();
  if (!has_message.ok()) return finish(to_status(has_message.error()));
  if (!*has_message) return;
  if (response_.has_finished()) {
    is_finished_ = true;
    slot_.give_back();
    return StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK);
  }
  is_writing_ = true;
  StartWrite(&response_);
}

Result<bool> WatchReactor::next_message() {
  response_.Clear();
  if (!std::exchange(has_snapshot_, true)) {
    *response_.mutable_snapshot() = to_message(*job_);
    return true;
  }
  // The state is read first: what belongs to an end that it shows is there by then.
  const bool has_ended = store::is_terminal(job_->state());
  if (const auto events = job_->events_after(last_sequence_); !events.empty()) {
    *response_.mutable_event() = to_message(events.front());
    last_sequence_ = events.front().sequence;
    return true;
  }
  const jobs::Job::LatestProgress progress = job_->progress();
  if (!has_ended && progress.version > last_progress_) {
    *response_.mutable_progress() = to_message(progress.progress);
    last_progress_ = progress.version;
    return true;
  }
  const std::shared_ptr<jobs::TileSpool> tiles = request_.include_tiles() ? job_->tiles() : nullptr;
  // Another attempt begins with its own first tile.
  if (tiles != tiles_) {
    tiles_ = tiles;
    num_tiles_ = 0;
  }
  if (tiles && num_tiles_ < tiles->num_tiles()) {
    RADBAKE_ASSIGN_OR_RETURN(const std::string tile, tiles->read(num_tiles_++));
    if (!response_.mutable_tile()->ParseFromString(tile)) return internal_error("a spooled tile is not readable");
    return true;
  }
  if (has_ended) *response_.mutable_finished() = to_message(*job_);
  return has_ended;
}

}  // namespace radbake::service
