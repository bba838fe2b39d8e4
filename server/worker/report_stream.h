#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "radbake/v1/worker.grpc.pb.h"

namespace radbake::worker {

/// The worker's one conversation with its server: reports go up, commands come down.
///
/// Two threads serve it. One writes: what was queued, in order; else the latest progress, at most ten times and at
/// least once a second, so that a silent bake is still heard. The other reads commands. Thread-safe.
class ReportStream {
 public:
  /// Says hello. A server that is not there shows in the first wait.
  ReportStream(const std::shared_ptr<grpc::Channel>& channel, const v1::WorkerHello& hello);
  /// Ends the stream.
  ~ReportStream();

  /// Waits for the work. Empty: the server is gone.
  std::optional<v1::StartWork> wait_for_start();

  /// Tells how far the bake is. Never waits: only the latest is kept until it is written, but a new state is queued.
  void set_progress(const v1::Progress& progress);

  /// Queues a report; waits while the queue is full, so that a bake is no faster than its server. False: the server is
  /// gone.
  bool send(v1::WorkerReport report);

  /// Queues the last report, after which there is no progress, and waits until the server has stored what it was told.
  /// False: the server went before it said so.
  bool finish(v1::WorkerReport outcome);

  /// Requested when the server asks to cancel, and when it is gone.
  std::stop_token stop_token() const { return stop_.get_token(); }
  /// Requested when the server asks to end with the best result so far.
  std::stop_token finish_token() const { return finish_.get_token(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool enqueue(v1::WorkerReport report, std::unique_lock<std::mutex>& lock);
  void read_commands();
  void write_reports();
  std::optional<v1::WorkerReport> next_report();

  grpc::ClientContext context_;
  std::unique_ptr<v1::Workers::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WorkerReport, v1::WorkerCommand>> stream_;
  std::stop_source stop_, finish_;

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<v1::WorkerReport> queue_;
  v1::Progress progress_;
  bool is_progress_new_ = false;
  Clock::time_point progress_written_at_;
  bool has_outcome_ = false;
  std::optional<v1::StartWork> start_;
  bool is_accepted_ = false;
  bool is_gone_ = false;     // the server, or the connection to it
  bool is_closing_ = false;  // this object

  std::thread reader_;
  std::thread writer_;
};

}  // namespace radbake::worker
