#include "server/worker/run_report.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "server/radiosity/bake/cpu_clock.h"

namespace radbake::worker {

namespace {

/// When this process started, seconds since boot; negative if the system does not say.
double read_process_start() {
  // The 22nd field is the start in ticks since boot. The second is the program's name and may hold anything: count
  // from its closing bracket.
  std::ifstream file("/proc/self/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto bracket = text.rfind(')');
  if (bracket == std::string::npos) return -1;
  std::istringstream fields(text.substr(bracket + 1));
  std::string field;
  for (int i = 3; i <= 22; ++i) fields >> field;
  if (!fields) return -1;
  return std::stod(field) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace

double seconds_since_process_start() {
  // Read once: a worker in its sandbox finds no files.
  static const double kStartedAt = read_process_start();
  timespec now{};
  if (kStartedAt < 0 || ::clock_gettime(CLOCK_BOOTTIME, &now) != 0) return 0;
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec) - kStartedAt;
}

void StageClock::begin(const std::string& stage) {
  end();
  running_ = stage;
  began_at_ = Clock::now();
  cpu_began_at_ = radiosity::process_cpu_seconds();
}

void StageClock::end() {
  if (running_.empty()) return;
  stages_.push_back({std::exchange(running_, ""), std::chrono::duration<double>(Clock::now() - began_at_).count(),
                     radiosity::process_cpu_seconds() - cpu_began_at_});
}

v1::RunReport run_report(const WorkerIdentity& identity, const std::vector<radiosity::StageTime>& stages,
                         double wall_seconds, std::uint32_t threads) {
  v1::RunReport run;
  for (const radiosity::StageTime& time : stages) {
    v1::StageSeconds& stage = *run.add_stages();
    stage.set_stage(time.stage);
    stage.set_seconds(time.seconds);
    v1::StageSeconds& cpu = *run.add_cpu_stages();
    cpu.set_stage(time.stage);
    cpu.set_seconds(time.cpu_seconds);
  }
  run.set_wall_seconds(wall_seconds);

  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  run.set_cpu_seconds(seconds(usage.ru_utime) + seconds(usage.ru_stime));
  run.set_peak_memory_bytes(static_cast<std::uint64_t>(usage.ru_maxrss) * 1024);  // the kernel counts in KiB

  run.set_threads(threads);
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) == 0) run.set_host(host.data());
  run.set_job(identity.job);
  run.set_attempt(identity.attempt);
  run.set_worker_start_seconds(identity.start_seconds);
  return run;
}

}  // namespace radbake::worker
