// The queue before its start and at its end, without workers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/jobs/job_queue.h"
#include "tests/unit/store/temporary_folder.h"

namespace radbake::jobs {
namespace {

using ::testing::HasSubstr;

class NoGate : public WorkerGate {
 public:
  void adopt(store::FileDescriptor) override {}
};

class QueueStatsTest : public ::testing::Test {
 protected:
  QueueStatsTest()
      : content_(std::move(store::TenantContent::open(folder_.path(), {1 << 20, 0})).value()),
        jobs_(std::move(store::JobStore::open(folder_.path() / "jobs.sqlite")).value()) {
    options_.spool_folder = folder_.path() / "spool";
    options_.worker.program = "/no/such/worker";
  }

  static store::NewJob job(const std::string& request_id) {
    store::NewJob job;
    job.request_id = request_id;
    return job;
  }

  store::TemporaryFolder folder_;
  QueueOptions options_;
  NoGate gate_;
  std::unique_ptr<store::TenantContent> content_;
  std::unique_ptr<store::JobStore> jobs_;
};

TEST_F(QueueStatsTest, AsksToTryAgainUntilItHasTakenUpOldJobs) {
  const std::string name = jobs_->create(job("old")).value().name;
  JobQueue queue(options_, *jobs_, *content_);
  for (const Error& error : {queue.submit(job("new")).error(), queue.find(name).error(), queue.cancel(name).error(),
                             queue.finish(name).error(), queue.find_request("", "old", "").error(),
                             queue.start_plan({}, {}, [](const Result<std::string>&) {}).error()}) {
    EXPECT_EQ(error.code, ErrorCode::kUnavailable);
    EXPECT_THAT(error.message, HasSubstr("the server is starting"));
  }
  ASSERT_TRUE(queue.start(gate_).ok());
  EXPECT_TRUE(queue.find(name).ok());
}

TEST_F(QueueStatsTest, RefusesNewJobsAndPlansAndLeavesThoseThatWaitOnceItIsToEnd) {
  JobQueue queue(options_, *jobs_, *content_);
  ASSERT_TRUE(queue.start(gate_).ok());
  queue.refuse_new();
  for (const Error& error :
       {queue.submit(job("new")).error(), queue.start_plan({}, {}, [](const Result<std::string>&) {}).error()}) {
    EXPECT_EQ(error.code, ErrorCode::kUnavailable);
    EXPECT_THAT(error.message, HasSubstr("the server is stopping"));
  }
  // Nothing runs: nothing is waited for, however long the grace is.
  queue.let_finish(std::chrono::hours(1));
  EXPECT_EQ(queue.stats().num_waiting, 0u);
  EXPECT_EQ(queue.stats().num_running, 0u);
}

TEST_F(QueueStatsTest, CountsJobsThatWait) {
  options_.max_running = 0;
  JobQueue queue(options_, *jobs_, *content_);
  ASSERT_TRUE(queue.start(gate_).ok());
  ASSERT_TRUE(queue.submit(job("a")).ok());
  const auto second = queue.submit(job("b"));
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(queue.stats().num_waiting, 2u);
  ASSERT_TRUE(queue.cancel((*second)->record().name).ok());
  EXPECT_EQ(queue.stats().num_waiting, 1u);
}

}  // namespace
}  // namespace radbake::jobs
