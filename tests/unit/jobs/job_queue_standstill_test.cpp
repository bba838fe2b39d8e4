// What the disk and the system refuse.

#include "tests/unit/jobs/job_queue_fixture.h"

namespace radbake::jobs {
namespace {

TEST_F(JobQueueTest, KeepsAnOutcomeUntilTheDiskTakesIt) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  {
    const DatabaseOutage outage;
    run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
    EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty(); }));
    EXPECT_FALSE(queue_->submit({"b", "body", "label", "key", {}}).ok());
    EXPECT_TRUE(store::is_running(job->record().state));
    EXPECT_FALSE(link_->is_accepted);
  }
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  EXPECT_EQ(job->record().result, "result");
  EXPECT_TRUE(wait_until([&] { return link_->is_accepted && queue_->standstill().empty(); }));
}

TEST_F(JobQueueTest, StartsNothingWhileTheDiskRefuses) {
  const auto first = submit("a"), second = submit("b");
  const auto run = greet(first);
  ASSERT_NE(run, nullptr);
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(first, JobState::kSucceeded));
  {
    const DatabaseOutage outage;
    run->accept();
    EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty() || store::is_running(second->record().state); }));
  }
  EXPECT_TRUE(wait_for(second, JobState::kPreparing));
}

TEST_F(JobQueueTest, RefusesACancelThatCannotBeRecorded) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  const DatabaseOutage outage;
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty(); }));
  const auto cancelled = queue_->cancel(job->record().name);
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(cancelled.error().message, HasSubstr("cannot be recorded yet"));
}

TEST_F(JobQueueTest, KeepsJobsUntilAWorkerCanBeStarted) {
  std::filesystem::remove(options_.worker.program);
  const auto first = submit("a"), second = submit("b");
  EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty(); }));
  EXPECT_THAT(queue_->standstill(), HasSubstr("cannot start the worker " + options_.worker.program.string()));
  EXPECT_TRUE(wait_for(first, JobState::kQueued));
  write_worker("sleep 1000");
  EXPECT_TRUE(wait_for(first, JobState::kPreparing));
  EXPECT_EQ(first->record().failed_attempts, 0u);
  EXPECT_EQ(second->record().state, JobState::kQueued);
  EXPECT_TRUE(queue_->standstill().empty());
}

TEST_F(JobQueueTest, BlamesNoWorkerForWhatItSendsAfterTheDiskRefused) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  const std::string texels = "texels";
  {
    const DatabaseOutage outage;
    // It has sent all of these before it is told.
    for (const char* name : {"lightmap_0", "lightmap_1"}) {
      EXPECT_TRUE(run->report_chunk({name, 0, texels, digest_of(texels)}).ok());
    }
    run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {digest_of(texels)});
    EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty(); }));
  }
  EXPECT_TRUE(wait_until([&] { return num_starts_of(job) == 2; }));
  EXPECT_EQ(job->record().failed_attempts, 0u);
}

TEST_F(JobQueueTest, BakesOnWithoutACheckpointThatTheDiskRefuses) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  const std::string rows = "some rows", texels = "texels";
  {
    const DatabaseOutage outage;
    EXPECT_TRUE(run->report_chunk({"rows", 0, "some ", std::nullopt, true}).ok());
  }
  EXPECT_TRUE(run->report_chunk({"rows", 5, "rows", digest_of(rows), true}).ok());  // what is left of it
  EXPECT_TRUE(run->report_chunk({"pass", 0, rows, digest_of(rows), true}).ok());
  EXPECT_TRUE(run->report_chunk({"lightmap_0", 0, texels, digest_of(texels)}).ok());
  EXPECT_TRUE(wait_until([&] { return jobs_->checkpoints(job->record())->size() == 1; }));
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {digest_of(texels)});
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  EXPECT_EQ(job->record().attempt, 1u);
}

TEST_F(JobQueueTest, RecordsTheEndOfAFollowerWhenTheDiskTakesItAgain) {
  const auto leader = submit("a", "key"), follower = submit("b", "key");
  const auto run = greet(leader);
  ASSERT_NE(run, nullptr);
  EXPECT_TRUE(wait_for(follower, JobState::kPreparing));
  static std::atomic<int> num_commits;
  num_commits = 0;
  store::fault_hook = [](const char* operation) {
    // The leader's end is recorded, the follower's is not.
    return std::string(operation) == "commit" && ++num_commits == 2 ? ENOSPC : 0;
  };
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(leader, JobState::kSucceeded));
  EXPECT_TRUE(wait_for(follower, JobState::kSucceeded));
  store::fault_hook = nullptr;
  EXPECT_GE(num_commits, 3);
}

TEST_F(JobQueueTest, HoldsNoWorkerToBeSilentWhileItsResultGoesToTheDisk) {
  options_.worker.silence_limit = 200ms;
  open("sleep 1000");
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  store::fault_hook = [](const char* operation) {
    if (std::string(operation) == "sync") std::this_thread::sleep_for(600ms);
    return 0;
  };
  const std::string texels = "texels";
  EXPECT_TRUE(run->report_chunk({"lightmap_0", 0, texels, digest_of(texels)}).ok());
  store::fault_hook = nullptr;
  EXPECT_EQ(run->kill_reason(), "");
  EXPECT_TRUE(wait_until([&] { return !run->kill_reason().empty(); }));  // but from now on
}

TEST_F(JobQueueTest, StandsStillWhereTheDiskTakesNoUploadAndNoJob) {
  store::ContentStore& store = **content_->of("");
  const std::string text = "a mesh";
  const std::function<bool()> attempts[] = {
      [&] { return store.append_upload(digest_of(text), 0, std::as_bytes(std::span(text))).ok(); },
      [&] {
        return queue_->submit({"a", "body", "label", "key", {}}).ok();
      },
  };
  for (const auto& attempt : attempts) {
    EXPECT_TRUE(wait_until([&] { return queue_->standstill().empty(); }));
    const DatabaseOutage outage;
    EXPECT_FALSE(attempt());
    EXPECT_TRUE(wait_until([&] { return !queue_->standstill().empty(); }));
  }
  EXPECT_TRUE(wait_until([&] { return queue_->standstill().empty(); }));
  for (const auto& attempt : attempts) EXPECT_TRUE(attempt());
}

}  // namespace
}  // namespace radbake::jobs
