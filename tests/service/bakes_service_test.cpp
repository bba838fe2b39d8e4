#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <limits>
#include <set>
#include <thread>

#include "common/base/version.h"
#include "google/rpc/error_details.pb.h"
#include "radbake/v1/scene.pb.h"
#include "server/store/failpoint.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;

class BakesServiceTest : public ::testing::Test {
 protected:
  grpc::Status submit(const v1::SubmitBakeRequest& request, v1::Bake* bake = nullptr) {
    v1::Bake own;
    return client_.bakes->SubmitBake(new_context().get(), request, bake ? bake : &own);
  }

  /// The field that a request is refused for.
  std::string refused_field(const v1::SubmitBakeRequest& request) {
    const grpc::Status status = submit(request);
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
    const auto bad = detail_of<google::rpc::BadRequest>(status);
    return bad ? bad->field_violations(0).field() : "none";
  }

  grpc::Status plan(FakeWork work, v1::Plan* plan, std::chrono::milliseconds limit = kCallLimit) {
    v1::PlanBakeRequest request;
    *request.mutable_manifest() = client_.upload_scene();
    request.mutable_settings()->set_seed(work);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + limit);
    return client_.bakes->PlanBake(&context, request, plan);
  }

  static service::BakeServerOptions options_in(const std::filesystem::path& folder) {
    service::BakeServerOptions options = TestServer::options_in(folder);
    options.limits.max_queued_bakes = 2;
    options.limits.max_meshes = 10;
    options.queue.plan_limit = std::chrono::milliseconds(300);
    options.limits.max_running_plans = 1;
    return options;
  }

  TemporaryFolder folder_;
  TestServer server_{options_in(folder_.path())};
  TestClient client_ = server_.client();
};

TEST_F(BakesServiceTest, BakesASceneToItsEnd) {
  const v1::Bake submitted = client_.submit(kSucceed);
  EXPECT_THAT(submitted.name(), ::testing::StartsWith("bakes/"));
  EXPECT_EQ(submitted.label(), "box.glb");
  const v1::Bake bake = client_.watch(submitted.name()).finished();
  EXPECT_EQ(bake.state(), v1::SUCCEEDED) << bake.error().message();
  EXPECT_EQ(bake.attempt(), 1u);
  EXPECT_EQ(bake.bake_key().size(), 64u);
  EXPECT_GE(bake.finished_unix_ms(), bake.created_unix_ms());
  ASSERT_EQ(bake.result().layers_size(), 1);
  // The layer's blob can be had.
  v1::FindMissingRequest request;
  *request.add_digests() = bake.result().layers(0).blob();
  v1::FindMissingResponse response;
  ASSERT_TRUE(client_.content->FindMissing(new_context().get(), request, &response).ok());
  EXPECT_EQ(response.missing_size(), 0);
  EXPECT_EQ(request.digests(0).size_bytes(), 4u * kTileSize * kTileSize * kFakeChannels * sizeof(float));
}

TEST_F(BakesServiceTest, AnswersTheSameRequestWithTheSameBake) {
  const v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kSucceed);
  v1::Bake first, second;
  ASSERT_TRUE(submit(request, &first).ok());
  ASSERT_TRUE(submit(request, &second).ok());
  EXPECT_EQ(first.name(), second.name());
  client_.wait_for(first.name(), v1::SUCCEEDED);
  ASSERT_TRUE(submit(request, &second).ok());
  EXPECT_EQ(first.name(), second.name());
  EXPECT_EQ(second.state(), v1::SUCCEEDED);
}

TEST_F(BakesServiceTest, RefusesARequestIdWithAnotherBody) {
  v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kSucceed);
  ASSERT_TRUE(submit(request).ok());
  request.mutable_settings()->set_rays(7);
  EXPECT_EQ(submit(request).error_code(), grpc::ALREADY_EXISTS);
}

TEST_F(BakesServiceTest, GivesEqualWorkEqualBakeKeys) {
  const v1::Digest manifest = client_.upload_scene();
  v1::SubmitBakeRequest request = client_.request_for(manifest, kSucceed);
  v1::Bake a, b, c;
  ASSERT_TRUE(submit(request, &a).ok());
  client_.wait_for(a.name(), v1::SUCCEEDED);
  request.set_request_id(request.request_id() + " again");
  request.mutable_run()->set_threads(2);  // changes no result
  ASSERT_TRUE(submit(request, &b).ok());
  client_.wait_for(b.name(), v1::SUCCEEDED);
  request.set_request_id(request.request_id() + " again");
  request.mutable_settings()->set_rays(9);
  ASSERT_TRUE(submit(request, &c).ok());
  EXPECT_NE(a.name(), b.name());
  EXPECT_EQ(a.bake_key(), b.bake_key());
  EXPECT_NE(a.bake_key(), c.bake_key());
}

TEST_F(BakesServiceTest, GivesEachTargetAndEachBudgetABakeKeyOfItsOwn) {
  const v1::Digest manifest = client_.upload_scene();
  std::set<std::string> keys;
  const auto add_key = [&](double max_error, std::uint64_t time_budget_ms) {
    v1::SubmitBakeRequest request = client_.request_for(manifest, kSucceed);
    request.set_validate_only(true);
    request.mutable_settings()->set_max_error(max_error);
    request.mutable_settings()->set_time_budget_ms(time_budget_ms);
    v1::Bake bake;
    EXPECT_TRUE(submit(request, &bake).ok());
    keys.insert(bake.bake_key());
  };
  add_key(0, 0);
  add_key(0, 0);
  EXPECT_EQ(keys.size(), 1u);
  add_key(0, 1000);
  add_key(0, 2000);
  add_key(0.02, 0);
  add_key(0.02, 1000);
  EXPECT_EQ(keys.size(), 5u);
  // The key is the digest of the settings' bytes: those without the fields are as they were before there were any.
  v1::BakeSettings old;
  old.set_atlas_size(64);
  old.set_rays(7);
  EXPECT_EQ(old.SerializeAsString(), "\x08\x40\x18\x07");
}

TEST_F(BakesServiceTest, NamesEveryMissingBlob) {
  v1::SceneManifest manifest;
  for (const char* mesh : {"mesh one", "mesh two"}) *manifest.add_meshes()->mutable_blob() = digest_message(mesh);
  const std::string bytes = manifest.SerializeAsString();
  const v1::SubmitBakeRequest request = client_.request_for(digest_message(bytes), kSucceed);

  // First the manifest itself.
  auto failure = detail_of<google::rpc::PreconditionFailure>(submit(request));
  ASSERT_TRUE(failure.has_value());
  ASSERT_EQ(failure->violations_size(), 1);
  EXPECT_EQ(failure->violations(0).type(), "MISSING");
  EXPECT_THAT(failure->violations(0).subject(), HasSubstr(request.manifest().sha256()));

  // Then the meshes that it names.
  ASSERT_TRUE(client_.upload(bytes).ok());
  ASSERT_TRUE(client_.upload("mesh one").ok());
  const grpc::Status status = submit(request);
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  failure = detail_of<google::rpc::PreconditionFailure>(status);
  ASSERT_TRUE(failure.has_value());
  ASSERT_EQ(failure->violations_size(), 1);
  EXPECT_EQ(failure->violations(0).subject(), "blobs/" + digest_message("mesh two").sha256() + "/8");
}

TEST_F(BakesServiceTest, RefusesWithoutEndingTheConnectionWhenThousandsOfBlobsAreMissing) {
  TemporaryFolder folder;
  TestServer server(TestServer::options_in(folder.path()));  // with the default limit on meshes
  TestClient client = server.client();
  v1::SceneManifest manifest;
  for (int i = 0; i < 3000; ++i) *manifest.add_meshes()->mutable_blob() = digest_message("mesh " + std::to_string(i));
  const std::string bytes = manifest.SerializeAsString();
  ASSERT_TRUE(client.upload(bytes, nullptr, 100'000).ok());
  v1::Bake bake;
  const grpc::Status status =
      client.bakes->SubmitBake(new_context().get(), client.request_for(digest_message(bytes), kSucceed), &bake);
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("3000 blobs"));
}

TEST_F(BakesServiceTest, NamesTheFieldThatIsOutOfRange) {
  const v1::Digest manifest = client_.upload_scene();
  auto request = client_.request_for(manifest, kSucceed);
  for (const unsigned size : {63u, 32u, 96u, 100u, 8192u}) {
    request.mutable_settings()->set_atlas_size(size);
    EXPECT_EQ(refused_field(request), "settings.atlas_size") << size;
  }
  EXPECT_THAT(submit(request).error_message(), ::testing::AllOf(HasSubstr("8192"), HasSubstr("power of two")));
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->set_texels_per_meter(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(refused_field(request), "settings.texels_per_meter");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->set_rays(1'000'000);
  EXPECT_EQ(refused_field(request), "settings.rays");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->add_effects()->set_effect("caustics");
  EXPECT_EQ(refused_field(request), "settings.effects");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->add_layers(v1::EXTRA_LAYER_UNSPECIFIED);
  EXPECT_EQ(refused_field(request), "settings.layers");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->set_ao_distance(-1);
  EXPECT_EQ(refused_field(request), "settings.ao_distance");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_settings()->set_max_error(1.5);
  EXPECT_EQ(refused_field(request), "settings.max_error");
  EXPECT_THAT(submit(request).error_message(), HasSubstr("1.5"));
  request = client_.request_for(manifest, kSucceed);
  request.clear_request_id();
  EXPECT_EQ(refused_field(request), "request_id");
  request = client_.request_for(manifest, kSucceed);
  request.mutable_manifest()->set_sha256("ABC");
  EXPECT_EQ(refused_field(request), "manifest");
}

TEST_F(BakesServiceTest, RefusesAManifestThatIsNone) {
  const std::string bytes = "\x0a\xff\xff";
  ASSERT_TRUE(client_.upload(bytes).ok());
  EXPECT_EQ(refused_field(client_.request_for(digest_message(bytes), kSucceed)), "manifest");
}

TEST_F(BakesServiceTest, NamesTheLimitThatASceneIsAbove) {
  v1::SceneManifest manifest;
  for (int i = 0; i < 11; ++i) *manifest.add_meshes()->mutable_blob() = digest_message("mesh");
  const std::string bytes = manifest.SerializeAsString();
  ASSERT_TRUE(client_.upload(bytes).ok());
  const grpc::Status status = submit(client_.request_for(digest_message(bytes), kSucceed));
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  const auto quota = detail_of<google::rpc::QuotaFailure>(status);
  ASSERT_TRUE(quota.has_value());
  EXPECT_EQ(quota->violations(0).subject(), "max_meshes");
  EXPECT_EQ(quota->violations(0).description(), "11 is above max_meshes 10");
}

TEST_F(BakesServiceTest, RefusesABakeThatTheQueueHasNoRoomFor) {
  const v1::Bake running = client_.submit(kRunUntilCancelled);
  client_.wait_for(running.name(), v1::FORM_FACTORS);
  client_.submit(kSucceed);
  client_.submit(kSucceed);
  const grpc::Status status = submit(client_.request_for(client_.upload_scene(), kSucceed));
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of<google::rpc::QuotaFailure>(status)->violations(0).subject(), "max_queued_bakes");
  EXPECT_TRUE(detail_of<google::rpc::RetryInfo>(status).has_value());
}

TEST_F(BakesServiceTest, SaysThatTheDiskIsFullWhereTheDatabaseHasNoRoom) {
  const v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kSucceed);
  store::fault_hook = [](const char* operation) { return operation == std::string("commit") ? ENOSPC : 0; };
  const grpc::Status status = submit(request);
  store::fault_hook = nullptr;
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of<google::rpc::QuotaFailure>(status)->violations(0).subject(), "min_free_disk_bytes");
  EXPECT_FALSE(detail_of<google::rpc::RetryInfo>(status).has_value());
}

TEST_F(BakesServiceTest, CancelsAQueuedBakeAtOnce) {
  const v1::Bake running = client_.submit(kRunUntilCancelled);
  const v1::Bake queued = client_.submit(kSucceed);
  ASSERT_TRUE(client_.cancel(queued.name()).ok());
  const v1::Bake bake = client_.get(queued.name());
  EXPECT_EQ(bake.state(), v1::CANCELLED);
  EXPECT_NE(bake.finished_unix_ms(), 0);
  ASSERT_TRUE(client_.cancel(running.name()).ok());
  EXPECT_EQ(client_.watch(running.name()).finished().state(), v1::CANCELLED);
}

TEST_F(BakesServiceTest, CancelsARunningBakeAndAnEndedOneWithoutError) {
  const v1::Bake bake = client_.submit(kRunUntilCancelled);
  client_.wait_for(bake.name(), v1::FORM_FACTORS);
  ASSERT_TRUE(client_.cancel(bake.name()).ok());
  ASSERT_TRUE(client_.cancel(bake.name()).ok());
  EXPECT_EQ(client_.watch(bake.name()).finished().state(), v1::CANCELLED);
  EXPECT_TRUE(client_.cancel(bake.name()).ok());
  EXPECT_EQ(client_.get(bake.name()).state(), v1::CANCELLED);
}

TEST_F(BakesServiceTest, FinishesARunningBakeAndAnEndedOneWithoutError) {
  const v1::Bake bake = client_.submit(kRunUntilCancelled);
  client_.wait_for(bake.name(), v1::FORM_FACTORS);
  ASSERT_TRUE(client_.finish(bake.name()).ok());
  EXPECT_TRUE(client_.finish(bake.name()).ok());
  const v1::Bake finished = client_.watch(bake.name()).finished();
  EXPECT_EQ(finished.state(), v1::SUCCEEDED) << finished.error().message();
  EXPECT_EQ(finished.result().layers_size(), 1);
  EXPECT_TRUE(client_.finish(bake.name()).ok());
  EXPECT_EQ(client_.get(bake.name()).state(), v1::SUCCEEDED);
}

TEST_F(BakesServiceTest, FinishesAQueuedBakeAsSoonAsItRuns) {
  const v1::Bake running = client_.submit(kRunUntilCancelled);
  const v1::Bake queued = client_.submit(kRunUntilCancelled);
  ASSERT_TRUE(client_.finish(queued.name()).ok());
  EXPECT_EQ(client_.get(queued.name()).state(), v1::QUEUED);
  ASSERT_TRUE(client_.cancel(running.name()).ok());
  EXPECT_EQ(client_.watch(queued.name()).finished().state(), v1::SUCCEEDED);
}

TEST_F(BakesServiceTest, CancelsABakeThatWasToFinish) {
  const v1::Bake bake = client_.submit(kIgnoreCancel);
  client_.wait_for(bake.name(), v1::FORM_FACTORS);
  ASSERT_TRUE(client_.finish(bake.name()).ok());
  ASSERT_TRUE(client_.cancel(bake.name()).ok());
  EXPECT_EQ(client_.watch(bake.name()).finished().state(), v1::CANCELLED);
}

TEST_F(BakesServiceTest, TellsPassErrorAndWhatWasAsked) {
  v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kRunUntilCancelled);
  request.mutable_settings()->set_max_error(0.02);
  v1::Bake bake;
  ASSERT_TRUE(submit(request, &bake).ok());
  client_.wait_for(bake.name(), v1::FORM_FACTORS);
  const v1::Progress progress = client_.get(bake.name()).progress();
  EXPECT_EQ(progress.pass(), kFakePass);
  EXPECT_EQ(progress.relative_error(), kFakeError);
  EXPECT_EQ(progress.relative_error_low(), kFakeErrorLow);
  EXPECT_EQ(progress.relative_error_high(), kFakeErrorHigh);
  EXPECT_EQ(progress.asked_error(), 0.02);
  ASSERT_TRUE(client_.finish(bake.name()).ok());
  client_.watch(bake.name());
}

TEST_F(BakesServiceTest, TellsWorkersHowLongABakeHasWaited) {
  const v1::Bake running = client_.submit(kRunUntilCancelled);
  const v1::Bake queued = client_.submit(kSucceed);
  const std::chrono::duration<double> wait = std::chrono::milliseconds(50);
  std::this_thread::sleep_for(wait);
  ASSERT_TRUE(client_.finish(running.name()).ok());
  EXPECT_GE(client_.watch(queued.name()).finished().result().report().run().wall_seconds(), wait.count());
}

TEST_F(BakesServiceTest, SaysThatABakeDoesNotExist) {
  v1::GetBakeRequest request;
  request.set_name("bakes/none");
  v1::Bake bake;
  const grpc::Status status = client_.bakes->GetBake(new_context().get(), request, &bake);
  EXPECT_EQ(status.error_code(), grpc::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("bakes/none"));
  EXPECT_EQ(client_.cancel("bakes/none").error_code(), grpc::NOT_FOUND);
  EXPECT_EQ(client_.finish("bakes/none").error_code(), grpc::NOT_FOUND);
  EXPECT_EQ(client_.watch("bakes/none").status.error_code(), grpc::NOT_FOUND);
}

TEST_F(BakesServiceTest, ListsBakesNewestFirstPageByPage) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) {
    names.push_back(client_.submit(kSucceed).name());
    client_.wait_for(names.back(), v1::SUCCEEDED);
  }
  v1::ListBakesRequest request;
  request.set_page_size(2);
  v1::ListBakesResponse page;
  ASSERT_TRUE(client_.bakes->ListBakes(new_context().get(), request, &page).ok());
  ASSERT_EQ(page.bakes_size(), 2);
  EXPECT_EQ(page.bakes(0).name(), names[2]);
  EXPECT_EQ(page.bakes(1).name(), names[1]);
  EXPECT_FALSE(page.bakes(0).has_result());
  request.set_page_token(page.next_page_token());
  page.Clear();
  ASSERT_TRUE(client_.bakes->ListBakes(new_context().get(), request, &page).ok());
  ASSERT_EQ(page.bakes_size(), 1);
  EXPECT_EQ(page.bakes(0).name(), names[0]);
  EXPECT_EQ(page.next_page_token(), "");
  request.set_page_token("x");
  EXPECT_EQ(client_.bakes->ListBakes(new_context().get(), request, &page).error_code(), grpc::INVALID_ARGUMENT);
}

TEST_F(BakesServiceTest, PlansWithoutQueueingBehindBakes) {
  client_.submit(kRunUntilCancelled);
  v1::Plan answer;
  const grpc::Status status = plan(kSucceed, &answer);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(answer.num_patches(), static_cast<std::uint64_t>(kFakePatches));
}

TEST_F(BakesServiceTest, ValidatesASubmitWithAPlanAndQueuesNothing) {
  v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kSucceed);
  request.set_validate_only(true);
  v1::Bake bake;
  const grpc::Status status = submit(request, &bake);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(bake.name(), "");
  EXPECT_EQ(bake.plan().num_patches(), static_cast<std::uint64_t>(kFakePatches));
  EXPECT_EQ(bake.label(), "box.glb");
  v1::ListBakesResponse page;
  ASSERT_TRUE(client_.bakes->ListBakes(new_context().get(), {}, &page).ok());
  EXPECT_EQ(page.bakes_size(), 0);

  // The same id is still free, and the key is that of the bake.
  request.set_validate_only(false);
  v1::Bake submitted;
  ASSERT_TRUE(submit(request, &submitted).ok());
  EXPECT_EQ(submitted.bake_key(), bake.bake_key());
  EXPECT_FALSE(submitted.has_plan());
}

TEST_F(BakesServiceTest, ValidatesAllThatASubmitIsRefusedFor) {
  v1::SubmitBakeRequest request = client_.request_for(client_.upload_scene(), kSucceed);
  request.set_validate_only(true);
  request.mutable_settings()->set_rays(1'000'000);
  EXPECT_EQ(refused_field(request), "settings.rays");
  request = client_.request_for(client_.upload_scene(), kSucceed);
  request.set_validate_only(true);
  request.clear_request_id();
  EXPECT_EQ(refused_field(request), "request_id");
  request = client_.request_for(digest_message("not uploaded"), kSucceed);
  request.set_validate_only(true);
  EXPECT_EQ(submit(request).error_code(), grpc::FAILED_PRECONDITION);
  request = client_.request_for(client_.upload_scene(), kFailBadScene);
  request.set_validate_only(true);
  v1::Bake bake;
  EXPECT_THAT(submit(request, &bake).error_message(), HasSubstr("vertex 3"));
}

TEST_F(BakesServiceTest, TellsWorkersWhatTheLastBakesCost) {
  v1::Plan answer;
  ASSERT_TRUE(plan(kSucceed, &answer).ok());
  EXPECT_EQ(answer.prediction().total().cpu_seconds(), 0);
  client_.wait_for(client_.submit(kSucceed).name(), v1::SUCCEEDED);
  ASSERT_TRUE(plan(kSucceed, &answer).ok());
  EXPECT_EQ(answer.prediction().total().cpu_seconds(), kFakeRayCost);
  EXPECT_TRUE(std::filesystem::exists(options_in(folder_.path()).data / "costs.txt"));
}

TEST_F(BakesServiceTest, TellsWhyAPlanFailed) {
  v1::Plan answer;
  const grpc::Status bad_scene = plan(kFailBadScene, &answer);
  EXPECT_EQ(bad_scene.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_THAT(bad_scene.error_message(), HasSubstr("vertex 3"));
  const grpc::Status crash = plan(kCrash, &answer);
  EXPECT_EQ(crash.error_code(), grpc::INTERNAL);
  EXPECT_THAT(crash.error_message(), HasSubstr("SIGSEGV"));
  const grpc::Status late = plan(kHang, &answer);
  EXPECT_THAT(late.error_message(), HasSubstr("longer than its limit of 0.3 s"));
}

TEST_F(BakesServiceTest, StopsAPlanWhenItsClientLeaves) {
  v1::Plan answer;
  EXPECT_EQ(plan(kRunUntilCancelled, &answer, std::chrono::milliseconds(100)).error_code(), grpc::DEADLINE_EXCEEDED);
  // One plan at a time is allowed here: the next one gets through only when the first one's worker has gone.
  grpc::Status status;
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  do {
    status = plan(kSucceed, &answer);
  } while (status.error_code() == grpc::RESOURCE_EXHAUSTED && std::chrono::steady_clock::now() < limit);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(BakesServiceTest, TellsItsCapabilities) {
  v1::Capabilities capabilities;
  ASSERT_TRUE(client_.server->GetCapabilities(new_context().get(), {}, &capabilities).ok());
  EXPECT_EQ(capabilities.engine_version(), kEngineVersion);
  EXPECT_EQ(capabilities.protocol_major(), kProtocolMajor);
  EXPECT_EQ(capabilities.limits().max_meshes(), 10u);
  EXPECT_EQ(capabilities.limits().chunk_bytes(), Limits().chunk_bytes);
  EXPECT_THAT(capabilities.outputs(), ::testing::Contains("lightmap"));
  EXPECT_EQ(client_.server->GetCapabilities(new_context("2").get(), {}, &capabilities).error_code(),
            grpc::FAILED_PRECONDITION);
}

}  // namespace
}  // namespace radbake::testing
