#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job_progress.h"
#include "server/jobs/tile_spool.h"
#include "server/store/job_record.h"

namespace radbake::jobs {

/// What watchers see of a job: its record and events as stored, and while it runs the latest progress and the tiles.
/// Thread-safe. Watchers keep it alive; the queue forgets it when it ends.
class Job {
 public:
  Job(store::JobRecord record, std::vector<store::JobEvent> events);

  const std::string& name() const { return name_; }
  store::JobState state() const;
  /// A copy, with all inputs.
  store::JobRecord record() const;
  std::vector<store::JobEvent> events_after(std::uint64_t sequence) const;
  /// When it came into its present state; 0 for a job without events.
  std::int64_t entered_unix_ms() const;

  /// The latest progress of this attempt, and a number that grows with each: a slow watcher skips some.
  struct LatestProgress {
    std::uint64_t version = 0;  ///< 0: none yet
    JobProgress progress;
  };
  LatestProgress progress() const;

  /// The tiles of the newest attempt that has sent any or could; null if there was none in this server's life.
  std::shared_ptr<TileSpool> tiles() const;

  /// True when the server is about to end: watchers must go although the job has not ended.
  bool is_closing() const;

  /// Calls `wake` after every change, until unsubscribe() has returned. `wake` must be quick and must not call this
  /// job.
  std::uint64_t subscribe(std::function<void()> wake);
  void unsubscribe(std::uint64_t subscription);

  // For the queue: each of these wakes the watchers.
  void set_record(store::JobRecord record, store::JobEvent event);
  void set_progress(const JobProgress& progress);
  void set_tiles(std::shared_ptr<TileSpool> tiles);
  void tile_arrived();
  void close();
  /// It has got on: what it lost before does not count.
  void forget_lost_attempts();
  /// From now on another job shows this one's progress and tiles.
  void add_follower(const std::shared_ptr<Job>& follower);
  void remove_follower(const std::shared_ptr<Job>& follower);
  std::vector<std::shared_ptr<Job>> followers() const;

 private:
  void wake_watchers();

  const std::string name_;
  mutable std::mutex mutex_;  // guards what follows
  store::JobRecord record_;
  std::vector<store::JobEvent> events_;
  LatestProgress progress_;
  std::shared_ptr<TileSpool> tiles_;
  bool is_closing_ = false;
  std::vector<std::shared_ptr<Job>> followers_;

  std::mutex watchers_mutex_;  // held while watchers are woken, so that unsubscribe() waits for the call
  std::map<std::uint64_t, std::function<void()>> watchers_;
  std::uint64_t next_subscription_ = 1;
};

}  // namespace radbake::jobs
