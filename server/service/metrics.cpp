#include "server/service/metrics.h"

#include <prometheus/text_serializer.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/base/version.h"

namespace radbake::service {
namespace {

using prometheus::BuildCounter;
using prometheus::BuildGauge;
using prometheus::BuildHistogram;

const prometheus::Histogram::BucketBoundaries kStageBounds = {0.01, 0.1, 0.5, 1, 5, 15, 60, 300, 1800, 7200, 43200};
const prometheus::Histogram::BucketBoundaries kRpcBounds = {0.001, 0.005, 0.02, 0.1, 0.5, 2, 10, 60};

/// "form factors" as a label: "form_factors".
std::string label_of(store::JobState state) {
  std::string name = store::job_state_name(state);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

const char* label_of(jobs::AttemptEnd end) {
  switch (end) {
    case jobs::AttemptEnd::kOutcome: return "outcome";
    case jobs::AttemptEnd::kCancelled: return "cancelled";
    case jobs::AttemptEnd::kServerStopping: return "server_stopping";
    case jobs::AttemptEnd::kWorkerDied: return "worker_died";
    case jobs::AttemptEnd::kWorkerKilled: return "worker_killed";
    case jobs::AttemptEnd::kServerFailed: return "server_failed";
  }
  return "unknown";
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double open_descriptors() {
  std::error_code problem;
  std::filesystem::directory_iterator entries("/proc/self/fd", problem);
  if (problem) return 0;
  // One is the look itself.
  return static_cast<double>(std::distance(entries, std::filesystem::directory_iterator())) - 1;
}

template <typename Integer>
double as_double(Integer number) {
  return static_cast<double>(number);
}

}  // namespace

Metrics::Metrics()
    : bakes_ended_(BuildCounter()
                       .Name("radbake_bakes_ended_total")
                       .Help("Bakes that came to an end, by final state")
                       .Register(registry_)),
      attempts_ended_(BuildCounter()
                          .Name("radbake_attempts_ended_total")
                          .Help("Workers' attempts at bakes that came to an end, by reason")
                          .Register(registry_)),
      stage_seconds_(BuildHistogram()
                         .Name("radbake_stage_seconds")
                         .Help("Time that bakes spent in a stage before they left it")
                         .Register(registry_)),
      rays_(BuildCounter()
                .Name("radbake_rays_total")
                .Help("Rays traced by bakes that reported a result")
                .Register(registry_)
                .Add({})),
      cache_hits_(BuildCounter()
                      .Name("radbake_cache_lookups_total")
                      .Help("Submits, by whether a bake with the same key was there already")
                      .Register(registry_)
                      .Add({{"result", "hit"}})),
      cache_misses_(BuildCounter()
                        .Name("radbake_cache_lookups_total")
                        .Help("Submits, by whether a bake with the same key was there already")
                        .Register(registry_)
                        .Add({{"result", "miss"}})),
      rpcs_(BuildCounter().Name("radbake_rpcs_total").Help("Calls that ended, by method and code").Register(registry_)),
      rpc_seconds_(BuildHistogram()
                       .Name("radbake_rpc_seconds")
                       .Help("Duration of calls; uploads, downloads and watches take as long as their client")
                       .Register(registry_)),
      rpcs_open_(BuildGauge()
                     .Name("radbake_rpcs_open")
                     .Help("Calls that have begun and not ended: open watches are those of WatchBake")
                     .Register(registry_)),
      cpu_seconds_(BuildCounter()
                       .Name("radbake_process_cpu_seconds_total")
                       .Help("Processor time of the server's own process, without workers")
                       .Register(registry_)
                       .Add({})) {
  // What is counted is there from the start: a rate needs a first value.
  for (const auto state : {store::JobState::kSucceeded, store::JobState::kFailed, store::JobState::kCancelled}) {
    bakes_ended_.Add({{"state", label_of(state)}});
  }
  for (const auto end :
       {jobs::AttemptEnd::kOutcome, jobs::AttemptEnd::kCancelled, jobs::AttemptEnd::kServerStopping,
        jobs::AttemptEnd::kWorkerDied, jobs::AttemptEnd::kWorkerKilled, jobs::AttemptEnd::kServerFailed}) {
    attempts_ended_.Add({{"reason", label_of(end)}});
  }
  gauge("radbake_build_info", "1; the labels say what runs",
        {{"version", kEngineVersion},
         {"protocol", std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor)}})
      .Set(1);
  gauge("radbake_process_start_time_seconds", "When the server was started, in seconds since 1970")
      .Set(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
}

prometheus::Gauge& Metrics::gauge(const std::string& name, const std::string& help, const prometheus::Labels& labels) {
  return BuildGauge().Name(name).Help(help).Register(registry_).Add(labels);
}

void Metrics::state_changed(store::JobState from, store::JobState to, double seconds_in_from) {
  // Back to the queue: the stage was broken off, maybe by the end of an earlier server, and the time says nothing.
  if (to == store::JobState::kQueued) return;
  stage_seconds_.Add({{"stage", label_of(from)}}, kStageBounds).Observe(seconds_in_from);
  if (store::is_terminal(to)) bakes_ended_.Add({{"state", label_of(to)}}).Increment();
}

void Metrics::attempt_ended(jobs::AttemptEnd end) { attempts_ended_.Add({{"reason", label_of(end)}}).Increment(); }

void Metrics::bake_reported(std::uint64_t num_rays, double rays_per_second, std::uint64_t peak_memory_bytes) {
  rays_.Increment(as_double(num_rays));
  gauge("radbake_last_bake_rays_per_second", "Of the last bake that reported a result").Set(rays_per_second);
  gauge("radbake_last_bake_peak_memory_bytes", "Of the last bake that reported a result: its worker's")
      .Set(as_double(peak_memory_bytes));
}

void Metrics::cache_looked_up(bool is_hit) { (is_hit ? cache_hits_ : cache_misses_).Increment(); }

void Metrics::rpc_began(const std::string& method) { rpcs_open_.Add({{"method", method}}).Increment(); }

void Metrics::rpc_ended(const std::string& method, const std::string& code, double seconds) {
  rpcs_open_.Add({{"method", method}}).Decrement();
  rpcs_.Add({{"method", method}, {"code", code}}).Increment();
  rpc_seconds_.Add({{"method", method}}, kRpcBounds).Observe(seconds);
}

void Metrics::read_process() {
  gauge("radbake_process_resident_memory_bytes", "Memory of the server's own process, without workers")
      .Set(resident_bytes());
  gauge("radbake_process_open_fds", "Open descriptors of the server's own process").Set(open_descriptors());
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) {
    gauge("radbake_process_max_fds", "Descriptors that it may open").Set(as_double(files.rlim_cur));
  }
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) != 0) return;
  const double seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  cpu_seconds_.Increment(seconds - cpu_seen_);
  cpu_seen_ = seconds;
}

std::string Metrics::render(const MetricsSnapshot& snapshot, const Readiness& readiness) {
  const std::lock_guard lock(render_mutex_);
  read_process();
  gauge("radbake_ready", "1 when the server takes work").Set(readiness.is_ready() ? 1 : 0);
  for (const Obstacle obstacle : kObstacles) {
    gauge("radbake_obstacle", "1 for what keeps the server from taking work", {{"reason", obstacle_name(obstacle)}})
        .Set(readiness.has(obstacle) ? 1 : 0);
  }
  gauge("radbake_waiting_bakes", "Bakes in the queue").Set(as_double(snapshot.queue.num_waiting));
  gauge("radbake_running_bakes", "Bakes that have a worker").Set(as_double(snapshot.queue.num_running));
  gauge("radbake_running_plans", "Plans that are being made").Set(as_double(snapshot.queue.num_plans));
  gauge("radbake_max_queued_bakes", "The limit of that name").Set(as_double(snapshot.max_queued_bakes));
  gauge("radbake_max_running_bakes", "The limit of that name").Set(as_double(snapshot.max_running_bakes));
  gauge("radbake_content_bytes", "Scenes and results on the disk, and the room that uploads have reserved")
      .Set(as_double(snapshot.content_bytes));
  gauge("radbake_upload_bytes", "Received of uploads that are not complete").Set(as_double(snapshot.upload_bytes));
  gauge("radbake_disk_free_bytes", "Free on the data folder's disk").Set(as_double(snapshot.free_disk_bytes));
  gauge("radbake_min_free_disk_bytes", "The limit of that name").Set(as_double(snapshot.min_free_disk_bytes));
  return prometheus::TextSerializer().Serialize(registry_.Collect());
}

}  // namespace radbake::service
