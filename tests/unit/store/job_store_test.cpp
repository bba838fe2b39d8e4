#include "server/store/job_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/store/temporary_folder.h"

namespace radbake::store {
namespace {

class JobStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { open(); }

  void open() {
    store_.reset();
    auto store = JobStore::open(file_);
    ASSERT_TRUE(store.ok()) << store.error().message;
    store_ = std::move(store).value();
  }

  static NewJob new_job(const std::string& request_id) {
    const Digest manifest = digest_of(std::string("manifest")), mesh = digest_of(std::string("mesh"));
    return {request_id, "body", "box.glb", "key", {manifest, std::string("set\0tings", 9), "run", {manifest, mesh}}};
  }

  JobRecord create(const std::string& request_id) {
    auto job = store_->create(new_job(request_id));
    EXPECT_TRUE(job.ok()) << job.error().message;
    return std::move(job).value();
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "jobs.sqlite";
  std::unique_ptr<JobStore> store_;
};

TEST_F(JobStoreTest, KeepsEverythingOfAJobAcrossAStart) {
  const std::string name = create("a").name;
  ASSERT_TRUE(store_->append_event(name, {JobState::kPreparing, "starts"}).ok());
  ASSERT_TRUE(
      store_
          ->append_event(name, {.state = JobState::kSucceeded, .message = "done", .result = std::string("re\0sult", 7)})
          .ok());
  open();
  const auto job = store_->get(name);
  ASSERT_TRUE(job.ok());
  const NewJob expected = new_job("a");
  EXPECT_EQ(job->label, expected.label);
  EXPECT_EQ(job->bake_key, expected.bake_key);
  EXPECT_EQ(job->work.manifest, expected.work.manifest);
  EXPECT_EQ(job->work.settings, expected.work.settings);
  EXPECT_EQ(job->work.run, expected.work.run);
  EXPECT_EQ(job->work.inputs, expected.work.inputs);
  EXPECT_EQ(job->state, JobState::kSucceeded);
  EXPECT_EQ(job->result, std::string("re\0sult", 7));
  EXPECT_EQ(job->last_sequence, 3u);
  EXPECT_FALSE(job->error.has_value());
  EXPECT_GT(job->finished_unix_ms, 0);
}

TEST_F(JobStoreTest, KnowsARequestByItsIdAndBody) {
  EXPECT_FALSE((*store_->find_request("", "a", "body")).has_value());
  const std::string name = create("a").name;
  EXPECT_EQ((*store_->find_request("", "a", "body"))->name, name);
  EXPECT_EQ(store_->find_request("", "a", "another body").error().code, ErrorCode::kAlreadyExists);
  EXPECT_EQ(store_->create(new_job("a")).error().code, ErrorCode::kAlreadyExists);
  EXPECT_EQ(store_->list(std::nullopt, 10, 0)->size(), 1u);
}

TEST_F(JobStoreTest, NumbersEventsWithoutGapsAndReadsThemFromAnyOn) {
  const std::string name = create("a").name, other = create("b").name;
  ASSERT_TRUE(store_->append_event(name, {JobState::kPreparing, "one"}).ok());
  ASSERT_TRUE(store_->append_event(other, {JobState::kCancelled, "other"}).ok());
  ASSERT_TRUE(store_->append_event(name, {JobState::kSolving, "two"}).ok());
  const auto all = store_->events_after(name, 0);
  ASSERT_EQ(all->size(), 3u);
  for (std::size_t i = 0; i < all->size(); ++i) EXPECT_EQ((*all)[i].sequence, i + 1);
  EXPECT_EQ((*all)[0].state, JobState::kQueued);
  const auto rest = store_->events_after(name, 2);
  ASSERT_EQ(rest->size(), 1u);
  EXPECT_EQ(rest->front().message, "two");
  EXPECT_TRUE(store_->events_after(name, 3)->empty());
}

TEST_F(JobStoreTest, KeepsTheErrorOfAFailure) {
  const std::string name = create("a").name;
  const Error error{ErrorCode::kInvalidArgument, "mesh 'box' has no area"};
  ASSERT_TRUE(store_->append_event(name, {.state = JobState::kFailed, .message = "failed", .error = error}).ok());
  open();
  const auto job = store_->get(name);
  ASSERT_TRUE(job->error.has_value());
  EXPECT_EQ(job->error->code, error.code);
  EXPECT_EQ(job->error->message, error.message);
}

TEST_F(JobStoreTest, FindsUnfinishedJobsOldestFirst) {
  const std::string a = create("a").name, b = create("b").name, c = create("c").name;
  ASSERT_TRUE(store_->append_event(b, {JobState::kCancelled}).ok());
  ASSERT_TRUE(store_->append_event(c, {.state = JobState::kGathering, .attempt = 2, .lost_attempts = 1}).ok());
  open();
  const auto jobs = store_->unfinished();
  ASSERT_EQ(jobs->size(), 2u);
  EXPECT_EQ((*jobs)[0].name, a);
  EXPECT_EQ((*jobs)[1].name, c);
  EXPECT_EQ((*jobs)[1].attempt, 2u);
  EXPECT_EQ((*jobs)[1].lost_attempts, 1u);
  EXPECT_EQ((*jobs)[1].work.inputs.size(), 2u);
}

TEST_F(JobStoreTest, ListsNewestFirstBelowAnId) {
  std::vector<std::string> names;
  for (const char* id : {"a", "b", "c"}) names.push_back(create(id).name);
  const auto page = store_->list(std::nullopt, 2, 0);
  ASSERT_EQ(page->size(), 2u);
  EXPECT_EQ((*page)[0].name, names[2]);
  EXPECT_EQ((*page)[1].name, names[1]);
  const auto rest = store_->list(std::nullopt, 2, page->back().id);
  ASSERT_EQ(rest->size(), 1u);
  EXPECT_EQ(rest->front().name, names[0]);
}

TEST_F(JobStoreTest, SaysThatAJobDoesNotExist) {
  EXPECT_EQ(store_->get("bakes/none").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(store_->append_event("bakes/none", {}).error().code, ErrorCode::kNotFound);
}

TEST_F(JobStoreTest, KeepsTheRequestsOfTenantsApart) {
  NewJob job{"a", "body", "label", "key", {}, {.tenant = "one", .client = "me", .trace_id = "trace", .priority = -3}};
  const JobRecord first = *store_->create(job);
  EXPECT_EQ(first.owner.tenant, "one");
  EXPECT_EQ(first.owner.client, "me");
  EXPECT_EQ(first.owner.trace_id, "trace");
  EXPECT_EQ(first.owner.priority, -3);
  EXPECT_FALSE(store_->find_request("two", "a", "another body")->has_value());
  job.owner.tenant = "two";
  EXPECT_TRUE(store_->create(job).ok());
  EXPECT_EQ(store_->list("one", 10, 0)->size(), 1u);
  EXPECT_EQ(store_->list(std::nullopt, 10, 0)->size(), 2u);
}

TEST_F(JobStoreTest, AnswersWithAResultOnlyWhoMayShareIt) {
  NewJob job{"a", "body", "label", "key", {}, {.tenant = "one"}};
  const Digest output = digest_of(std::string("a lightmap"));
  const auto bake = [&](const std::string& request_id, bool is_shared, bool is_whole) {
    job.request_id = request_id;
    job.owner.is_shared = is_shared;
    const std::string name = store_->create(job)->name;
    EXPECT_TRUE(store_
                    ->append_event(name, {.state = JobState::kSucceeded,
                                          .result = "result of " + request_id,
                                          .outputs = {output},
                                          .is_whole = is_whole})
                    .ok());
    return name;
  };
  bake("private", false, true);
  bake("ended early", true, false);
  EXPECT_FALSE(store_->find_result("one", "key")->has_value());
  const std::string name = bake("good", true, true);
  EXPECT_FALSE(store_->find_result("two", "key")->has_value());
  EXPECT_FALSE(store_->find_result("one", "another key")->has_value());
  const auto stored = *store_->find_result("one", "key");
  ASSERT_TRUE(stored.has_value());
  EXPECT_EQ(stored->name, name);

  job.request_id = "again";
  const JobRecord answered = *store_->create(job, &*stored);
  EXPECT_EQ(answered.state, JobState::kSucceeded);
  EXPECT_EQ(answered.result, "result of good");
  EXPECT_TRUE(answered.is_from_store);
  EXPECT_EQ(answered.last_sequence, 2u);
  EXPECT_EQ(store_->events_after(answered.name, 0)->size(), 2u);
  EXPECT_THAT(*store_->outputs(answered.name), ::testing::ElementsAre(output));
}

TEST_F(JobStoreTest, CountsWhatItBakedForEachClient) {
  NewJob job{"a", "body", "label", "key", {}, {.tenant = "one", .client = "me"}};
  const JobRecord ended = *store_->create(job);
  ASSERT_TRUE(store_->append_event(ended.name, {.state = JobState::kSucceeded}).ok());
  job.request_id = "waits";
  ASSERT_TRUE(store_->create(job).ok());
  job.request_id = "answered";
  ASSERT_TRUE(store_->create(job, &ended).ok());
  const auto counts = *store_->ended_by_client(0);
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts[0].tenant, "one");
  EXPECT_EQ(counts[0].client, "me");
  EXPECT_EQ(counts[0].num_ended, 1u);
  EXPECT_TRUE(store_->ended_by_client(ended.created_unix_ms + 1'000'000)->empty());
}

TEST_F(JobStoreTest, KnowsWhichBlobsAreNeeded) {
  const Digest input = digest_of(std::string("input")), other_input = digest_of(std::string("other input")),
               output = digest_of(std::string("output")), checkpoint = digest_of(std::string("rows"));
  Work work;
  work.inputs = {input};
  const JobRecord waits = *store_->create({"a", "body", "label", "key", work});
  work.inputs = {other_input};
  const JobRecord ends = *store_->create({"b", "body", "label", "other key", work});
  ASSERT_TRUE(store_->append_event(ends.name, {.state = JobState::kSucceeded, .outputs = {output}}).ok());
  ASSERT_TRUE(store_->put_checkpoint(waits, {"rows", other_input}).ok());
  ASSERT_TRUE(store_->put_checkpoint(waits, {"rows", checkpoint}).ok());  // in its place
  EXPECT_EQ(*store_->needed_blobs(""), (std::set<Digest>{input, output, checkpoint}));
  EXPECT_TRUE(store_->needed_blobs("somebody else")->empty());

  EXPECT_EQ(*store_->forget_ended("", ends.created_unix_ms - 1000, 10), 0u);
  EXPECT_EQ(*store_->forget_ended("", ends.created_unix_ms + 1'000'000, 10), 1u);
  ASSERT_TRUE(store_->drop_checkpoints(waits, {"rows"}).ok());
  EXPECT_EQ(*store_->needed_blobs(""), std::set<Digest>{input});
}

TEST_F(JobStoreTest, KeepsCheckpointsForTheNextAttemptOfTheSameBake) {
  NewJob job{"a", "body", "label", "key", {}};
  const JobRecord first = *store_->create(job);
  ASSERT_TRUE(
      store_->append_event(first.name, {.state = JobState::kQueued, .lost_attempts = 2, .failed_attempts = 1}).ok());
  for (const char* name : {"rows/1", "rows/0", "pass"}) {
    ASSERT_TRUE(store_->put_checkpoint(first, {name, digest_of(std::string(name))}).ok());
  }
  // It has got on.
  EXPECT_EQ(store_->get(first.name)->lost_attempts, 0u);
  EXPECT_EQ(store_->get(first.name)->failed_attempts, 0u);
  ASSERT_TRUE(store_->drop_checkpoints(first, {"rows/1"}).ok());
  job.request_id = "b";
  const JobRecord equal = *store_->create(job);
  const auto left = *store_->checkpoints(equal);
  ASSERT_EQ(left.size(), 2u);
  EXPECT_EQ(left[0].name, "pass");
  EXPECT_EQ(left[1].digest, digest_of(std::string("rows/0")));
  job.request_id = "c";
  job.owner.is_shared = false;
  EXPECT_TRUE(store_->checkpoints(*store_->create(job))->empty());
}

TEST_F(JobStoreTest, DropsCheckpointsWithTheLastUnfinishedJobOfABake) {
  NewJob job{"a", "body", "label", "key", {}};
  const JobRecord first = *store_->create(job);
  job.request_id = "b";
  const JobRecord equal = *store_->create(job);
  job.request_id = "c";
  job.owner.is_shared = false;
  const JobRecord alone = *store_->create(job);
  job.owner = {.tenant = "somebody else"};
  const JobRecord others = *store_->create(job);
  for (const JobRecord& each : {first, alone, others}) {
    ASSERT_TRUE(store_->put_checkpoint(each, {"rows", digest_of(std::string("rows"))}).ok());
  }
  ASSERT_TRUE(store_->append_event(first.name, {JobState::kCancelled}).ok());
  EXPECT_EQ(store_->checkpoints(equal)->size(), 1u);
  ASSERT_TRUE(store_->append_event(equal.name, {JobState::kQueued}).ok());
  EXPECT_EQ(store_->checkpoints(equal)->size(), 1u);
  ASSERT_TRUE(store_->append_event(equal.name, {JobState::kFailed}).ok());
  EXPECT_TRUE(store_->checkpoints(equal)->empty());
  EXPECT_EQ(store_->checkpoints(alone)->size(), 1u);
  ASSERT_TRUE(store_->append_event(alone.name, {JobState::kSucceeded}).ok());
  EXPECT_TRUE(store_->checkpoints(alone)->empty());
  EXPECT_EQ(store_->checkpoints(others)->size(), 1u);
}

TEST_F(JobStoreTest, BringsAFileOfTheFirstVersionUpToDate) {
  const std::string name = store_->create({"a", "body", "label", "key", {}})->name;
  store_.reset();
  {
    auto database = Database::open(file_);
    ASSERT_TRUE(database
                    ->execute("DROP TABLE outputs; DROP TABLE checkpoints; ALTER TABLE jobs DROP COLUMN tenant;"
                              "ALTER TABLE jobs DROP COLUMN client; ALTER TABLE jobs DROP COLUMN trace_id;"
                              "ALTER TABLE jobs DROP COLUMN priority; ALTER TABLE jobs DROP COLUMN is_shared;"
                              "ALTER TABLE jobs DROP COLUMN is_whole; ALTER TABLE jobs DROP COLUMN is_from_store;"
                              "ALTER TABLE jobs DROP COLUMN failed_attempts; PRAGMA user_version=1")
                    .ok());
  }
  auto store = JobStore::open(file_);
  ASSERT_TRUE(store.ok()) << store.error().message;
  EXPECT_EQ((*store)->get(name)->label, "label");
  EXPECT_TRUE((*store)->get(name)->owner.is_shared);
}

TEST_F(JobStoreTest, SyncsEveryCommitAndMigratesAnEmptyFile) {
  store_.reset();
  auto database = Database::open(file_);
  ASSERT_TRUE(database.ok());
  const auto pragma = [&](const std::string& name) {
    auto query = database->prepare("PRAGMA " + name);
    EXPECT_TRUE(*query->step());
    return query->bytes(0);
  };
  EXPECT_EQ(pragma("journal_mode"), "wal");
  EXPECT_EQ(pragma("synchronous"), "2");  // FULL
  EXPECT_EQ(pragma("foreign_keys"), "1");
  EXPECT_EQ(pragma("user_version"), "2");
}

TEST_F(JobStoreTest, RefusesAFileOfANewerVersionAndAFileThatIsNone) {
  store_.reset();
  {
    auto database = Database::open(file_);
    ASSERT_TRUE(database->execute("PRAGMA user_version=1000").ok());
  }
  const auto newer = JobStore::open(file_);
  ASSERT_FALSE(newer.ok());
  EXPECT_EQ(newer.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(newer.error().message, ::testing::HasSubstr("1000"));
  EXPECT_FALSE(JobStore::open(folder_.path() / "no such folder" / "jobs.sqlite").ok());
}

TEST_F(JobStoreTest, UndoesAllOfATransactionThatFails) {
  store_.reset();
  auto database = Database::open(file_);
  const auto done = database->in_transaction([&]() -> Result<void> {
    RADBAKE_RETURN_IF_ERROR(database->execute("CREATE TABLE half (x)"));
    return internal_error("stopped in the middle");
  });
  EXPECT_FALSE(done.ok());
  EXPECT_FALSE(database->execute("SELECT * FROM half").ok());
}

}  // namespace
}  // namespace radbake::store
