#include "server/jobs/job.h"

#include <utility>

namespace radbake::jobs {

Job::Job(store::JobRecord record, std::vector<store::JobEvent> events)
    : name_(record.name), record_(std::move(record)), events_(std::move(events)) {}

store::JobState Job::state() const {
  const std::lock_guard lock(mutex_);
  return record_.state;
}

store::JobRecord Job::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

std::vector<store::JobEvent> Job::events_after(std::uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  std::vector<store::JobEvent> events;
  for (const store::JobEvent& event : events_) {
    if (event.sequence > sequence) events.push_back(event);
  }
  return events;
}

std::int64_t Job::entered_unix_ms() const {
  const std::lock_guard lock(mutex_);
  return events_.empty() ? 0 : events_.back().unix_ms;
}

Job::LatestProgress Job::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::shared_ptr<TileSpool> Job::tiles() const {
  const std::lock_guard lock(mutex_);
  return tiles_;
}

bool Job::is_closing() const {
  const std::lock_guard lock(mutex_);
  return is_closing_;
}

std::uint64_t Job::subscribe(std::function<void()> wake) {
  const std::lock_guard lock(watchers_mutex_);
  watchers_.emplace(next_subscription_, std::move(wake));
  return next_subscription_++;
}

void Job::unsubscribe(std::uint64_t subscription) {
  const std::lock_guard lock(watchers_mutex_);
  watchers_.erase(subscription);
}

void Job::wake_watchers() {
  const std::lock_guard lock(watchers_mutex_);
  for (const auto& [subscription, wake] : watchers_) wake();
}

void Job::set_record(store::JobRecord record, store::JobEvent event) {
  {
    const std::lock_guard lock(mutex_);
    record_ = std::move(record);
    events_.push_back(std::move(event));
  }
  wake_watchers();
}

void Job::set_progress(const JobProgress& progress) {
  {
    const std::lock_guard lock(mutex_);
    progress_.progress = progress;
    ++progress_.version;
  }
  wake_watchers();
  for (const auto& follower : followers()) follower->set_progress(progress);
}

void Job::set_tiles(std::shared_ptr<TileSpool> tiles) {
  for (const auto& follower : followers()) follower->set_tiles(tiles);
  const std::lock_guard lock(mutex_);
  tiles_ = std::move(tiles);
  progress_.progress = {};
}

void Job::tile_arrived() {
  wake_watchers();
  for (const auto& follower : followers()) follower->tile_arrived();
}

void Job::forget_lost_attempts() {
  const std::lock_guard lock(mutex_);
  record_.lost_attempts = record_.failed_attempts = 0;
}

void Job::add_follower(const std::shared_ptr<Job>& follower) {
  follower->set_tiles(tiles());
  if (const LatestProgress latest = progress(); latest.version > 0) follower->set_progress(latest.progress);
  const std::lock_guard lock(mutex_);
  followers_.push_back(follower);
}

void Job::remove_follower(const std::shared_ptr<Job>& follower) {
  const std::lock_guard lock(mutex_);
  std::erase(followers_, follower);
}

std::vector<std::shared_ptr<Job>> Job::followers() const {
  const std::lock_guard lock(mutex_);
  return followers_;
}

void Job::close() {
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
  }
  wake_watchers();
}

}  // namespace radbake::jobs
