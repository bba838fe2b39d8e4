#include "tests/unit/jobs/job_queue_fixture.h"

namespace radbake::jobs {
namespace {

TEST_F(JobQueueTest, RunsJobsInTheOrderInWhichTheyCame) {
  const auto first = submit("a"), second = submit("b"), third = submit("c"), fourth = submit("d");
  const auto run = greet(first);
  ASSERT_NE(run, nullptr);
  ASSERT_TRUE(queue_->cancel(second->record().name).ok());  // from the middle of the queue
  EXPECT_EQ(second->record().state, JobState::kCancelled);
  EXPECT_EQ(third->record().state, JobState::kQueued);
  ASSERT_TRUE(queue_->cancel(first->record().name).ok());
  EXPECT_TRUE(wait_until([&] { return link_->is_cancelled.load(); }));
  run->report_outcome({WorkOutcome::Kind::kCancelled, "", {}}, {});
  EXPECT_TRUE(wait_for(first, JobState::kCancelled));
  EXPECT_TRUE(wait_for(third, JobState::kPreparing));
  EXPECT_EQ(second->record().state, JobState::kCancelled);
  EXPECT_EQ(fourth->record().state, JobState::kQueued);
}

TEST_F(JobQueueTest, PublishesAResultOnceAndFreesThePlaceOfAWorkerThatDoesNotExit) {
  const auto first = submit("a"), second = submit("b");
  const auto run = greet(first);
  ASSERT_NE(run, nullptr);
  JobProgress progress;
  progress.state = JobState::kSolving;
  run->report_progress(progress);
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  run->report_outcome({WorkOutcome::Kind::kFailed, "", internal_error("too late")}, {});
  EXPECT_TRUE(wait_for(first, JobState::kSucceeded));
  EXPECT_TRUE(wait_until([&] { return link_->is_accepted.load(); }));
  EXPECT_EQ(first->record().result, "result");
  const auto events = first->events_after(0);
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(events[2].state, JobState::kSolving);
  EXPECT_TRUE(wait_for(second, JobState::kPreparing));
}

TEST_F(JobQueueTest, TellsAWorkerToFinishOnceAndThatACancelWins) {
  const auto job = submit("a");
  ASSERT_NE(greet(job), nullptr);
  const std::string name = job->record().name;
  ASSERT_TRUE(queue_->finish(name).ok());
  ASSERT_TRUE(queue_->finish(name).ok());
  EXPECT_EQ(link_->calls, "start finish ");
  EXPECT_TRUE(store::is_running(job->record().state));
  ASSERT_TRUE(queue_->cancel(name).ok());
  ASSERT_TRUE(queue_->finish(name).ok());
  EXPECT_EQ(link_->calls, "start finish cancel ");
  EXPECT_TRUE(wait_for(job, JobState::kCancelled));  // the script does not obey: it is killed
  EXPECT_TRUE(queue_->finish(name).ok());
  EXPECT_EQ(job->record().state, JobState::kCancelled);
  EXPECT_EQ(queue_->finish("bakes/none").error().code, ErrorCode::kNotFound);
}

TEST_F(JobQueueTest, RemembersThatAWaitingJobIsToFinishUntilItRuns) {
  const auto first = submit("a"), second = submit("b");
  const auto run = greet(first);
  ASSERT_NE(run, nullptr);
  ASSERT_TRUE(queue_->finish(second->record().name).ok());
  EXPECT_EQ(second->record().state, JobState::kQueued);
  link_ = std::make_shared<FakeLink>();
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  ASSERT_NE(greet(second), nullptr);
  EXPECT_EQ(link_->calls, "start finish ");
}

TEST_F(JobQueueTest, TellsAWorkerHowLongItsJobHasWaited) {
  const auto first = submit("a"), second = submit("b");
  const auto run = greet(first);
  ASSERT_NE(run, nullptr);
  EXPECT_GE(link_->waited_seconds, 0);
  const std::chrono::duration<double> wait = 30ms;
  std::this_thread::sleep_for(wait);
  link_ = std::make_shared<FakeLink>();
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  ASSERT_NE(greet(second), nullptr);
  EXPECT_GE(link_->waited_seconds, wait.count());
}

TEST_F(JobQueueTest, RecordsTheFurthestStateOfABakeWhosePassesGoThroughAllAgain) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  JobProgress progress;
  for (const JobState state :
       {JobState::kGathering, JobState::kFormFactors, JobState::kSolving, JobState::kGathering}) {
    progress.state = state;
    progress.pass = 1;
    run->report_progress(progress);
  }
  run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  std::vector<JobState> states;
  for (const store::JobEvent& event : job->events_after(0)) states.push_back(event.state);
  EXPECT_THAT(states, ::testing::ElementsAre(JobState::kQueued, JobState::kPreparing, JobState::kGathering,
                                             JobState::kSucceeded));
  EXPECT_EQ(job->progress().progress.pass, 1u);
}

TEST_F(JobQueueTest, RefusesASecondWorkerAndAnotherAttempt) {
  const auto job = submit("a");
  greet(job);
  const std::string name = job->record().name;
  for (const std::uint32_t attempt : {1u, 2u}) {
    const auto refused = queue_->greet({name, attempt, kEngineVersion, kProtocolMajor}, link_);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kFailedPrecondition);
  }
  EXPECT_FALSE(queue_->greet({"bakes/none", 1, kEngineVersion, kProtocolMajor}, link_).ok());
}

TEST_F(JobQueueTest, SaysHowAWorkerEnded) {
  write_worker("echo first >&2; echo out of luck >&2; exit 3");
  EXPECT_THAT(error_of(submit("a")), ::testing::AllOf(HasSubstr("exited with code 3"), HasSubstr("out of luck")));
  write_worker("kill -ABRT $$");
  EXPECT_THAT(error_of(submit("b")), HasSubstr("was killed by SIGABRT"));
  write_worker("exit 0");
  EXPECT_THAT(error_of(submit("c")), HasSubstr("exited with code 0"));
}

TEST_F(JobQueueTest, StopsAWorkerThatLostItsConnection) {
  const auto job = submit("a");
  greet(job)->report_disconnected();
  EXPECT_THAT(error_of(job), HasSubstr("closed its connection without a result"));
}

TEST_F(JobQueueTest, KillsTheChildrenOfAWorkerWithIt) {
  write_worker("sleep 1000 >/dev/null 2>&1 & echo $! > " + (folder_.path() / "child").string() + "; exit 5");
  error_of(submit("a"));
  int child = 0;
  std::ifstream(folder_.path() / "child") >> child;
  ASSERT_GT(child, 0);
  // Gone, or waiting as a zombie for an init that reaps.
  EXPECT_TRUE(wait_until([&] {
    std::string pid, name, state;
    std::ifstream(("/proc/" + std::to_string(child) + "/stat")) >> pid >> name >> state;
    return state.empty() || state == "Z" || state == "X";
  }));
}

TEST_F(JobQueueTest, RefusesJobsBeyondItsLimitButNotTheSameRequest) {
  options_.max_queued = 1;
  open("sleep 1000");
  const auto running = submit("a");
  ASSERT_TRUE(wait_for(running, JobState::kPreparing));
  const auto waiting = submit("b");
  EXPECT_EQ(queue_->submit({"c", "body", "label", "key", {}}).error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(submit("b")->record().name, waiting->record().name);
}

TEST_F(JobQueueTest, QueuesRunningJobsAgainWhenItDrains) {
  const auto running = submit("a"), waiting = submit("b");
  ASSERT_TRUE(wait_for(running, JobState::kPreparing));
  queue_->drain();
  EXPECT_EQ(running->record().state, JobState::kQueued);
  EXPECT_TRUE(running->is_closing());
  EXPECT_EQ(queue_->submit({"c", "body", "label", "key", {}}).error().code, ErrorCode::kUnavailable);
  const std::string name = running->record().name;
  open("sleep 1000");
  const auto again = *queue_->find(name);
  EXPECT_TRUE(wait_for(again, JobState::kPreparing));
  EXPECT_EQ(again->record().attempt, 2u);
  EXPECT_EQ(again->record().lost_attempts, 0u);  // stopping in good order costs no attempt
}

TEST_F(JobQueueTest, GivesAJobUpThatTookTheServerDownTooOften) {
  queue_->drain();
  const std::string name = jobs_->create({"a", "body", "label", "key", {}})->name;
  // As a server that died leaves it.
  ASSERT_TRUE(jobs_->append_event(name, {.state = JobState::kGathering, .attempt = 3, .lost_attempts = 4}).ok());
  open("sleep 1000");
  const store::JobRecord record = (*queue_->find(name))->record();
  EXPECT_EQ(record.state, JobState::kFailed);
  EXPECT_THAT(record.error->message, HasSubstr("5 times"));
}

TEST_F(JobQueueTest, TriesAgainWhenAWorkerDiesUntilItHasDiedTooOften) {
  options_.max_failed_attempts = 3;
  open("echo $* >> " + (folder_.path() / "starts").string() + "; exit 3");
  const auto job = submit("a");
  EXPECT_THAT(error_of(job), ::testing::AllOf(HasSubstr("exited with code 3"), HasSubstr("3 attempts")));
  EXPECT_EQ(job->record().attempt, 3u);
  std::ifstream starts(folder_.path() / "starts");
  std::string line;
  int num_starts = 0;
  for (; std::getline(starts, line); ++num_starts)
    EXPECT_THAT(line, HasSubstr("--attempt " + std::to_string(num_starts + 1)));
  EXPECT_EQ(num_starts, 3);
}

TEST_F(JobQueueTest, GivesTheNextAttemptWhatTheLastOneLeft) {
  options_.max_failed_attempts = 2;
  open("sleep 1000");
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  EXPECT_EQ(link_->num_checkpoints, 0u);
  const std::string rows = "some rows", pass = "a pass";
  for (const std::string& text : {rows, pass}) {
    EXPECT_TRUE(run->report_chunk({text, 0, text, digest_of(text), true}).ok());
  }
  run->report_dropped_checkpoints({pass});
  link_ = std::make_shared<FakeLink>();
  run->report_disconnected();
  EXPECT_TRUE(wait_until([&] { return job->record().attempt == 2; }));
  const auto next = greet(job, 2);
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(link_->num_checkpoints, 1u);
  EXPECT_EQ(job->record().failed_attempts, 1u);
  // Who gets on has not failed: not the attempt before, either.
  EXPECT_TRUE(next->report_chunk({pass, 0, pass, digest_of(pass), true}).ok());
  EXPECT_TRUE(wait_until([&] { return job->record().failed_attempts == 0; }));
  next->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  EXPECT_TRUE(jobs_->checkpoints(job->record())->empty());
  // Nor is there anything left of them.
  for (const std::string& text : {rows, pass}) {
    EXPECT_TRUE(wait_until([&] { return !(*content_->of(""))->contains(digest_of(text)); }));
  }
}

TEST_F(JobQueueTest, TellsWhereAJobStandsInTheQueue) {
  const auto running = submit("a"), second = submit("b"), third = submit("c");
  ASSERT_TRUE(wait_for(running, JobState::kPreparing));
  auto places = queue_->places();
  EXPECT_FALSE(places.contains(running->record().name));
  EXPECT_EQ(places[second->record().name].position, 1u);
  EXPECT_EQ(places[third->record().name].position, 2u);
  EXPECT_LT(places[second->record().name].expected_start_unix_ms, places[third->record().name].expected_start_unix_ms);
}

TEST(TileSpool, GivesTilesBackInTheirOrder) {
  store::TemporaryFolder folder;
  auto spool = std::move(TileSpool::create(folder.path())).value();
  ASSERT_TRUE(spool->append("one").ok());
  ASSERT_TRUE(spool->append("").ok());
  ASSERT_TRUE(spool->append(std::string("t\0o", 3)).ok());
  ASSERT_EQ(spool->num_tiles(), 3u);
  EXPECT_EQ(*spool->read(2), std::string("t\0o", 3));
  EXPECT_EQ(*spool->read(0), "one");
  EXPECT_EQ(*spool->read(1), "");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));  // no name: nothing outlives the server
}

TEST(Job, KeepsOnlyTheLatestProgress) {
  Job job({}, {});
  int num_calls = 0;
  const auto subscription = job.subscribe([&] { ++num_calls; });
  for (int i = 1; i <= 5; ++i) {
    JobProgress progress;
    progress.fraction = 0.1 * i;
    job.set_progress(progress);
  }
  EXPECT_EQ(job.progress().version, 5u);
  EXPECT_EQ(job.progress().progress.fraction, 0.5);
  EXPECT_EQ(num_calls, 5);
  job.unsubscribe(subscription);
  job.set_progress({});
  EXPECT_EQ(num_calls, 5);
}

TEST_F(JobQueueTest, DoesNotListenToAnAttemptThatEnded) {
  options_.max_failed_attempts = 2;
  open("[ $6 = 2 ] || { sleep 0.5; exit 3; }; sleep 1000");
  const auto job = submit("a");
  const auto first = greet(job);
  ASSERT_NE(first, nullptr);
  EXPECT_TRUE(wait_until([&] { return num_starts_of(job) == 2; }));
  const std::string rows = "some rows";
  EXPECT_TRUE(first->report_chunk({"rows", 0, rows, digest_of(rows), true}).ok());
  first->report_dropped_checkpoints({"rows"});
  first->report_outcome({WorkOutcome::Kind::kSucceeded, "late", {}}, {});
  link_ = std::make_shared<FakeLink>();
  const auto second = greet(job, 2);
  ASSERT_NE(second, nullptr);
  second->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  EXPECT_EQ(job->record().result, "result");
}

TEST_F(JobQueueTest, EndsABakeThatTakesTooLong) {
  options_.bake_limit = 50ms;
  options_.max_failed_attempts = 3;
  open("sleep 1000");
  const auto job = submit("a");
  EXPECT_EQ(error_of(job), "the worker took longer than its limit of 0.05 s and was stopped");
  EXPECT_EQ(job->record().attempt, 1u);
}

}  // namespace
}  // namespace radbake::jobs
