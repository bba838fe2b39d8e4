// The queue without a wire: workers are shell scripts, and the test takes the service's part.

#include "server/jobs/job_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "common/base/version.h"
#include "tests/unit/store/temporary_folder.h"

namespace radbake::jobs {
namespace {

using namespace std::chrono_literals;
using store::JobState;
using ::testing::HasSubstr;

constexpr auto kWaitLimit = 60s;

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
    options_.disk_retry = 5ms;
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
  ASSERT_TRUE(jobs_->append_event(name, {JobState::kGathering, 3, 4, "", "", {}}).ok());
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
}

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

TEST_F(JobQueueTest, TellsWhereAJobStandsInTheQueue) {
  const auto running = submit("a"), second = submit("b"), third = submit("c");
  ASSERT_TRUE(wait_for(running, JobState::kPreparing));
  auto places = queue_->places();
  EXPECT_FALSE(places.contains(running->record().name));
  EXPECT_EQ(places[second->record().name].position, 1u);
  EXPECT_EQ(places[third->record().name].position, 2u);
  EXPECT_LT(places[second->record().name].expected_start_unix_ms, places[third->record().name].expected_start_unix_ms);
}

TEST_F(JobQueueTest, KeepsAnOutcomeUntilTheDiskTakesIt) {
  const auto job = submit("a");
  const auto run = greet(job);
  ASSERT_NE(run, nullptr);
  {
    const DatabaseOutage outage;
    run->report_outcome({WorkOutcome::Kind::kSucceeded, "result", {}}, {});
    EXPECT_TRUE(wait_until([&] { return !queue_->disk_problem().empty(); }));
    EXPECT_FALSE(queue_->submit({"b", "body", "label", "key", {}}).ok());
    EXPECT_TRUE(store::is_running(job->record().state));
    EXPECT_FALSE(link_->is_accepted);
  }
  EXPECT_TRUE(wait_for(job, JobState::kSucceeded));
  EXPECT_EQ(job->record().result, "result");
  EXPECT_TRUE(wait_until([&] { return link_->is_accepted && queue_->disk_problem().empty(); }));
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
    EXPECT_TRUE(
        wait_until([&] { return !queue_->disk_problem().empty() || store::is_running(second->record().state); }));
  }
  EXPECT_TRUE(wait_for(second, JobState::kPreparing));
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

}  // namespace
}  // namespace radbake::jobs
