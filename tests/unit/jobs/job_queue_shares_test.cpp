// Equal jobs.

#include "tests/unit/jobs/job_queue_fixture.h"

namespace radbake::jobs {
namespace {

TEST_F(JobQueueTest, RunsEqualJobsOnceAndEndsThemAlike) {
  const auto leader = submit("a", "key"), follower = submit("b", "key"), other = submit("c", "other key");
  const auto run = greet(leader);
  ASSERT_NE(run, nullptr);
  EXPECT_TRUE(wait_for(follower, JobState::kPreparing));
  EXPECT_EQ(queue_->places()[follower->record().name].shares, leader->record().name);
  JobProgress progress;
  progress.state = JobState::kSolving;
  progress.fraction = 0.5;
  run->report_progress(progress);
  EXPECT_EQ(follower->progress().progress.fraction, 0.5);
  EXPECT_EQ(follower->tiles(), leader->tiles());
  const std::string lightmap = "texels";
  EXPECT_TRUE(run->report_chunk({"lightmap_0", 0, lightmap, digest_of(lightmap)}).ok());
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {digest_of(lightmap)});
  for (const auto& job : {leader, follower}) {
    EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
    EXPECT_EQ(job->record().result, "result");
  }
  EXPECT_EQ(num_starts_of(follower), 0);
  // And from now on without a worker.
  EXPECT_TRUE(wait_for(other, JobState::kPreparing));
  const auto later = submit("d", "key");
  EXPECT_EQ(later->record().state, JobState::kSucceeded);
  EXPECT_EQ(later->record().result, "result");
  EXPECT_TRUE(later->record().is_from_store);
  EXPECT_EQ(submit("e", "key", false)->record().state, JobState::kQueued);
  // What is not there any more is baked again.
  (*content_->of(""))->sweep({}, std::chrono::system_clock::now() + std::chrono::hours(1), 1000);
  EXPECT_EQ(submit("f", "key")->record().state, JobState::kQueued);
}

TEST_F(JobQueueTest, LetsAFollowerGoOnWhereItsLeaderIsCancelled) {
  const auto leader = submit("a", "key"), second = submit("b", "key"), third = submit("c", "key");
  const auto run = greet(leader);
  ASSERT_NE(run, nullptr);
  ASSERT_TRUE(queue_->cancel(third->record().name).ok());
  EXPECT_EQ(third->record().state, JobState::kCancelled);
  ASSERT_TRUE(queue_->cancel(leader->record().name).ok());
  EXPECT_TRUE(wait_for(leader, JobState::kCancelled));
  link_ = std::make_shared<FakeLink>();
  EXPECT_TRUE(wait_until([&] { return num_starts_of(second) == 1; }));
  const auto own = greet(second, second->record().attempt);
  ASSERT_NE(own, nullptr);
  own->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(second, JobState::kSucceeded));
  EXPECT_EQ(third->record().state, JobState::kCancelled);
}

TEST_F(JobQueueTest, GivesNobodyElseAResultThatSomebodyEndedEarly) {
  const auto leader = submit("a", "key"), follower = submit("b", "key");
  const auto run = greet(leader);
  ASSERT_NE(run, nullptr);
  ASSERT_TRUE(queue_->finish(leader->record().name).ok());
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "half a result", {}}, {});
  EXPECT_TRUE(wait_for(leader, JobState::kSucceeded));
  EXPECT_TRUE(wait_until([&] { return num_starts_of(follower) == 1; }));
  EXPECT_NE(submit("c", "key")->record().state, JobState::kSucceeded);
}

TEST_F(JobQueueTest, KeepsCheckpointsAsLongAsAJobCouldGoOnFromThem) {
  const auto leader = submit("a", "key"), second = submit("b", "key");
  const auto run = greet(leader);
  ASSERT_NE(run, nullptr);
  const std::string rows = "some rows";
  EXPECT_TRUE(run->report_chunk({rows, 0, rows, digest_of(rows), true}).ok());
  ASSERT_TRUE(queue_->cancel(leader->record().name).ok());
  run->report_outcome({WorkOutcome::Kind::kCancelled, "", {}}, {});
  EXPECT_TRUE(wait_for(leader, JobState::kCancelled));
  EXPECT_EQ(jobs_->checkpoints(second->record())->size(), 1u);
  ASSERT_TRUE(queue_->cancel(second->record().name).ok());
  EXPECT_TRUE(wait_for(second, JobState::kCancelled));
  EXPECT_TRUE(jobs_->checkpoints(second->record())->empty());
}

}  // namespace
}  // namespace radbake::jobs
