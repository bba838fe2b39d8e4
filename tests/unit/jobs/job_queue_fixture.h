// The queue without a wire: workers are shell scripts, and the test takes the service's part.

#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "common/base/version.h"
#include "server/jobs/job_queue.h"
#include "server/store/failpoint.h"
#include "tests/unit/store/temporary_folder.h"

namespace radbake::jobs {
using namespace std::chrono_literals;
using store::JobState;
using ::testing::HasSubstr;

inline constexpr auto kWaitLimit = 60s;

/// Keeps the sockets, so that they stay open.
class FakeGate : public WorkerGate {
 public:
  void adopt(store::FileDescriptor socket) override { sockets_.push_back(std::move(socket)); }

 private:
  std::vector<store::FileDescriptor> sockets_;
};

struct FakeLink : WorkerLink {
  void start(const WorkOrder& order) override {
    num_inputs = order.inputs.size();
    num_checkpoints = order.checkpoints.size();
    waited_seconds = order.waited_seconds;
    calls += "start ";
  }
  void cancel() override {
    is_cancelled = true;
    calls += "cancel ";
  }
  void finish() override {
    is_finishing = true;
    calls += "finish ";
  }
  void accept() override { is_accepted = true; }
  std::atomic<std::size_t> num_inputs = 0, num_checkpoints = 0;
  std::atomic<bool> is_cancelled = false, is_finishing = false, is_accepted = false;
  std::atomic<double> waited_seconds = -1;
  std::string calls;  // one at a time: the run calls under its lock
};

/// The database refuses every change, as on a full disk.
class DatabaseOutage {
 public:
  DatabaseOutage() {
    store::fault_hook = [](const char*) { return ENOSPC; };
  }
  ~DatabaseOutage() { store::fault_hook = nullptr; }
};

class JobQueueTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.max_failed_attempts = 1;
    open("sleep 1000");
  }

  void write_worker(const std::string& script) {
    std::ofstream(options_.worker.program) << "#!/bin/sh\n" << script << "\n";
    chmod(options_.worker.program.c_str(), 0700);
  }

  /// Opens the queue as a server's start does, with workers that run a script.
  void open(const std::string& script) {
    queue_.reset();
    jobs_.reset();
    options_.worker.program = folder_.path() / "worker";
    options_.spool_folder = folder_.path() / "spool";
    options_.check_interval = 5ms;
    options_.retry_interval = 5ms;
    options_.worker.exit_grace = 50ms;
    options_.worker.disconnect_grace = 50ms;
    write_worker(script);
    content_ = std::move(store::TenantContent::open(folder_.path(), {1 << 20, 0})).value();
    jobs_ = std::move(store::JobStore::open(folder_.path() / "jobs.sqlite")).value();
    queue_ = std::make_unique<JobQueue>(options_, *jobs_, *content_);
    ASSERT_TRUE(queue_->start(gate_).ok());
  }

  std::shared_ptr<Job> submit(const std::string& request_id) { return submit(request_id, "key of " + request_id); }
  std::shared_ptr<Job> submit(const std::string& request_id, const std::string& bake_key, bool is_shared = true) {
    auto job = queue_->submit({request_id, "body", "label", bake_key, {}, {"", "me", "", 0, is_shared}});
    EXPECT_TRUE(job.ok()) << job.error().message;
    return std::move(job).value();
  }

  /// Of workers of its own.
  static int num_starts_of(const std::shared_ptr<Job>& job) {
    int count = 0;
    for (const store::JobEvent& event : job->events_after(0)) count += event.message.ends_with(" starts");
    return count;
  }

  static bool wait_until(const std::function<bool()>& condition) {
    const auto limit = std::chrono::steady_clock::now() + kWaitLimit;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > limit) return false;
      std::this_thread::sleep_for(1ms);
    }
    return true;
  }
  static bool wait_for(const std::shared_ptr<Job>& job, JobState state) {
    return wait_until([&] { return job->record().state == state; });
  }
  static std::string error_of(const std::shared_ptr<Job>& job) {
    EXPECT_TRUE(wait_for(job, JobState::kFailed));
    return job->record().error ? job->record().error->message : "";
  }

  std::shared_ptr<WorkerRun> greet(const std::shared_ptr<Job>& job, std::uint32_t attempt = 1) {
    EXPECT_TRUE(wait_for(job, JobState::kPreparing));
    Result<std::shared_ptr<WorkerRun>> run = internal_error("not tried");
    EXPECT_TRUE(wait_until([&] {
      run = queue_->greet({job->record().name, attempt, kEngineVersion, kProtocolMajor}, link_);
      return run.ok();
    }));
    return run.ok() ? *run : nullptr;
  }

  store::TemporaryFolder folder_;
  QueueOptions options_;
  FakeGate gate_;
  std::shared_ptr<FakeLink> link_ = std::make_shared<FakeLink>();
  std::unique_ptr<store::TenantContent> content_;
  std::unique_ptr<store::JobStore> jobs_;
  std::unique_ptr<JobQueue> queue_;
};

}  // namespace radbake::jobs
