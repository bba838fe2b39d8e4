#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <mutex>

#include "radbake/v1/bake.pb.h"
#include "server/jobs/job_queue.h"
#include "server/service/call_slots.h"
#include "server/service/gate.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// One WatchBake call: snapshot, then events, progress and tiles as they come, the finished bake last.
///
/// A machine of one step: whatever happens (a change of the job, a finished write, a cancelled call) only schedules
/// step(), and step() alone decides what to write next or to finish. One write at a time, made from the job's present
/// state: a slow reader skips progress, and tiles wait for it on disk, so it costs one message of memory.
class WatchReactor : public grpc::ServerWriteReactor<v1::WatchBakeResponse>,
                     public std::enable_shared_from_this<WatchReactor> {
 public:
  static WatchReactor* start(const Admission& admission, CallSlots::Slot slot, jobs::JobQueue& queue,
                             store::TaskPool& pool, v1::WatchBakeRequest request);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  WatchReactor(access::Caller caller, CallSlots::Slot slot, jobs::JobQueue& queue, store::TaskPool& pool,
               v1::WatchBakeRequest request);

  void open();
  void schedule_step();
  void step();
  void finish(const grpc::Status& status);
  /// Fills response_ with what the reader lacks most; false if it lacks nothing.
  Result<bool> next_message();

  CallSlots::Slot slot_;
  jobs::JobQueue& queue_;
  store::TaskPool& pool_;
  const access::Caller caller_;
  const v1::WatchBakeRequest request_;
  std::shared_ptr<WatchReactor> self_;  // until OnDone
  std::atomic<bool> is_scheduled_ = false;
  std::atomic<bool> is_cancelled_ = false;

  std::mutex mutex_;  // guards what follows
  std::shared_ptr<jobs::Job> job_;
  std::uint64_t subscription_ = 0;
  bool is_writing_ = false;
  bool is_finished_ = false;
  v1::WatchBakeResponse response_;
  // What the reader has seen.
  bool has_snapshot_ = false;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t last_progress_ = 0;
  std::shared_ptr<jobs::TileSpool> tiles_;  // of the attempt that it sees
  std::size_t num_tiles_ = 0;               // of these
};

}  // namespace radbake::service
