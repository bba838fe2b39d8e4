#pragma once

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <cstdint>
#include <mutex>
#include <string>

#include "server/jobs/job_observer.h"
#include "server/jobs/job_queue.h"
#include "server/service/readiness.h"

namespace radbake::service {

/// What is read when somebody asks, beside what was counted as it happened.
struct MetricsSnapshot {
  jobs::QueueStats queue;
  std::uint64_t max_queued_bakes = 0;
  std::uint64_t max_running_bakes = 0;
  std::uint64_t content_bytes = 0;
  std::uint64_t upload_bytes = 0;
  std::uint64_t free_disk_bytes = 0;
  std::uint64_t min_free_disk_bytes = 0;
};

/// The numbers of a server, by Prometheus' rules: names radbake_*, base units, few labels with few values each.
/// deploy/docs/operations.md says what each means. Thread-safe.
class Metrics : public jobs::JobObserver {
 public:
  Metrics();

  void state_changed(store::JobState from, store::JobState to, double seconds_in_from) override;
  void attempt_ended(jobs::AttemptEnd end) override;
  void cache_looked_up(bool is_hit) override;

  /// A bake whose result was reported.
  void bake_reported(std::uint64_t num_rays, double rays_per_second, std::uint64_t peak_memory_bytes);

  void rpc_began(const std::string& method);
  void rpc_ended(const std::string& method, const std::string& code, double seconds);

  /// Prometheus' text format.
  std::string render(const MetricsSnapshot& snapshot, const Readiness& readiness);

 private:
  prometheus::Gauge& gauge(const std::string& name, const std::string& help, const prometheus::Labels& labels = {});
  void read_process();

  prometheus::Registry registry_;
  prometheus::Family<prometheus::Counter>& bakes_ended_;
  prometheus::Family<prometheus::Counter>& attempts_ended_;
  prometheus::Family<prometheus::Histogram>& stage_seconds_;
  prometheus::Counter& rays_;
  prometheus::Counter& cache_hits_;
  prometheus::Counter& cache_misses_;
  prometheus::Family<prometheus::Counter>& rpcs_;
  prometheus::Family<prometheus::Histogram>& rpc_seconds_;
  prometheus::Family<prometheus::Gauge>& rpcs_open_;
  prometheus::Counter& cpu_seconds_;
  std::mutex render_mutex_;  // guards cpu_seen_
  double cpu_seen_ = 0;
};

}  // namespace radbake::service
