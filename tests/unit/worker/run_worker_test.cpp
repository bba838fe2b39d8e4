#include "server/worker/run_worker.h"

#include <gmock/gmock.h>
#include <grpcpp/create_channel_posix.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "common/base/version.h"
#include "tests/unit/worker/worker_server.h"

namespace radbake {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Reports = std::vector<v1::WorkerReport>;

/// Runs a worker against a conversation, and returns its exit code.
int run_against(Conversation conversation) {
  const WorkerServer server(std::move(conversation));
  return worker::run_worker(grpc::CreateInsecureChannelFromFd("test", server.worker_fd()), {"bakes/7", 3, 0.5});
}

/// Orders one piece of work, and returns all reports; the worker must end well.
Reports reports_of(const v1::WorkerCommand& order) {
  Reports reports;
  const int exit_code = run_against([&](WorkerStream& stream) {
    stream.Write(order);
    reports = read_to_outcome(stream);
    accept(stream);
  });
  EXPECT_EQ(exit_code, worker::kExitDone);
  EXPECT_FALSE(reports.empty());
  return reports;
}

/// The states in order. A stream begins as PREPARING and need not say so.
std::vector<v1::BakeState> states_of(const Reports& reports) {
  std::vector<v1::BakeState> states = {v1::PREPARING};
  for (const v1::WorkerReport& report : reports) {
    if (report.has_progress() && states.back() != report.progress().state()) {
      states.push_back(report.progress().state());
    }
  }
  return states;
}

TEST(RunWorker, SaysHelloFirst) {
  const BlobFiles files(small_scene());
  const Reports reports = reports_of(files.order(kBakes));
  ASSERT_TRUE(reports.front().has_hello());
  EXPECT_EQ(reports.front().hello().job(), "bakes/7");
  EXPECT_EQ(reports.front().hello().attempt(), 3U);
  EXPECT_EQ(reports.front().hello().engine_version(), kEngineVersion);
  EXPECT_EQ(reports.front().hello().protocol_major(), kProtocolMajor);
}

TEST(RunWorker, ReportsEveryStateInOrderAndFewSteps) {
  const BlobFiles files(small_scene());
  const Reports reports = reports_of(files.order(kBakes));
  EXPECT_THAT(states_of(reports),
              ElementsAre(v1::PREPARING, v1::FORM_FACTORS, v1::SOLVING, v1::GATHERING, v1::WRITING));
  // The bake tells 200 steps in no time at all; what may pass is a change of state, and ten a second.
  EXPECT_LT(std::count_if(reports.begin(), reports.end(), [](const auto& report) { return report.has_progress(); }),
            50);
  double fraction = 0;
  for (const v1::WorkerReport& report : reports) {
    if (!report.has_progress()) continue;
    EXPECT_GE(report.progress().fraction(), fraction);
    fraction = report.progress().fraction();
  }
}

TEST(RunWorker, SendsTilesAndThePlaneThatTheResultNames) {
  const BlobFiles files(small_scene());
  const Reports reports = reports_of(files.order(kBakes));
  std::string plane;
  int num_tiles = 0, num_chunks = 0;
  v1::Digest digest;
  for (const v1::WorkerReport& report : reports) {
    if (report.has_tile()) {
      EXPECT_EQ(report.tile().layer_name(), "lightmap_0");
      EXPECT_EQ(report.tile().layer_width(), 128U);
      EXPECT_EQ(report.tile().x(), 64U * static_cast<unsigned>(num_tiles++));
      EXPECT_EQ(report.tile().data().size(), 64U * 64 * 4 * 4);
    }
    if (!report.has_chunk()) continue;
    ++num_chunks;
    EXPECT_EQ(report.chunk().blob(), "lightmap_0");
    EXPECT_EQ(report.chunk().offset(), plane.size());
    EXPECT_LE(report.chunk().data().size(), default_limits().chunk_bytes());
    plane += report.chunk().data();
    if (report.chunk().finish()) digest = report.chunk().digest();
  }
  EXPECT_EQ(num_tiles, 2);
  EXPECT_EQ(num_chunks, 2);
  ASSERT_EQ(plane.size(), 128U * 128 * 4 * 4);
  float third = 0;
  std::memcpy(&third, plane.data() + 3 * sizeof(float), sizeof third);
  EXPECT_EQ(third, 1.5F);

  ASSERT_TRUE(reports.back().has_bake_finished());
  const v1::BakeResult& result = reports.back().bake_finished();
  ASSERT_EQ(result.layers_size(), 1);
  EXPECT_EQ(result.layers(0).name(), "lightmap_0");
  EXPECT_EQ(result.layers(0).blob().sha256(), digest_of(plane).sha256);
  EXPECT_EQ(result.layers(0).blob().size_bytes(), plane.size());
  EXPECT_EQ(digest.sha256(), digest_of(plane).sha256);
  EXPECT_EQ(result.report().engine_version(), kEngineVersion);
  EXPECT_EQ(result.report().plan().survey().num_triangles(), 2U);
  EXPECT_FALSE(result.report().run().has_prediction());  // nothing was predicted
}

TEST(RunWorker, FillsInTheReportOfTheRun) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes);
  order.mutable_start()->mutable_costs()->set_row_ray(0.25);
  const Reports reports = reports_of(order);
  const v1::RunReport& run = reports.back().bake_finished().report().run();
  std::vector<std::string> stages;
  for (const v1::StageSeconds& stage : run.stages()) stages.push_back(stage.stage());
  EXPECT_THAT(stages, ElementsAre("decoding", "preparing", "gathering", "writing"));
  std::vector<std::string> cpu_stages;
  for (const v1::StageSeconds& stage : run.cpu_stages()) cpu_stages.push_back(stage.stage());
  EXPECT_EQ(cpu_stages, stages);
  EXPECT_EQ(run.cpu_stages(1).seconds(), 0.375);
  EXPECT_GT(run.cpu_stages(3).seconds(), 0);
  EXPECT_EQ(run.prediction().total().cpu_seconds(), 250);
  EXPECT_EQ(run.costs().texel_ray(), 0.125);
  EXPECT_GT(run.wall_seconds(), 0);
  EXPECT_GT(run.cpu_seconds(), 0);
  EXPECT_GT(run.peak_memory_bytes(), 1'000'000U);
  EXPECT_EQ(run.threads(), 2U);
  EXPECT_FALSE(run.host().empty());
  EXPECT_EQ(run.job(), "bakes/7");
  EXPECT_EQ(run.attempt(), 3U);
  EXPECT_EQ(run.worker_start_seconds(), 0.5);
  EXPECT_GT(run.rays_per_second(), 0);
  ASSERT_EQ(run.passes_size(), 2);
  EXPECT_EQ(run.passes(1).seconds(), 1.5);
  EXPECT_EQ(run.passes(1).cpu_seconds(), 2.5);
}

TEST(RunWorker, PlansWithoutBaking) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes, true);
  order.mutable_start()->mutable_costs()->set_row_ray(0.25);
  const Reports reports = reports_of(order);
  ASSERT_TRUE(reports.back().has_plan_finished());
  EXPECT_EQ(reports.back().plan_finished().atlas_size(), 128U);
  EXPECT_EQ(reports.back().plan_finished().survey().num_meshes(), 1U);
  EXPECT_EQ(reports.back().plan_finished().prediction().total().cpu_seconds(), 250);
}

TEST(RunWorker, ReportsABadSceneByName) {
  EncodedScene scene = small_scene();
  v1::SceneManifest manifest;
  manifest.ParseFromString(scene.blobs.back().bytes);
  manifest.mutable_meshes(0)->set_num_triangles(5);
  scene.blobs.back().bytes = manifest.SerializeAsString();
  scene.blobs.back().digest = digest_of(scene.blobs.back().bytes);
  const BlobFiles files(scene);
  for (const bool is_plan : {false, true}) {
    const Reports reports = reports_of(files.order(kBakes, is_plan));
    ASSERT_TRUE(reports.back().has_failed());
    EXPECT_EQ(reports.back().failed().code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(reports.back().failed().message(), HasSubstr("mesh 'node/floor#0' has 2 triangles, its record says 5"));
  }
}

TEST(RunWorker, ReportsABlobThatItDidNotInherit) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes);
  order.mutable_start()->mutable_inputs()->DeleteSubrange(0, 1);
  const Reports reports = reports_of(order);
  ASSERT_TRUE(reports.back().has_failed());
  EXPECT_EQ(reports.back().failed().code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(reports.back().failed().message(), HasSubstr("mesh 'node/floor#0': blob"));
}

TEST(RunWorker, ReportsABlobThatIsTooShort) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes);
  v1::StartWork& start = *order.mutable_start();
  start.mutable_manifest()->set_size_bytes(start.manifest().size_bytes() + 1);
  *start.mutable_inputs(start.inputs_size() - 1)->mutable_digest() = start.manifest();
  const Reports reports = reports_of(order);
  ASSERT_TRUE(reports.back().has_failed());
  EXPECT_EQ(reports.back().failed().code(), grpc::StatusCode::DATA_LOSS);
}

TEST(RunWorker, ReportsFailuresOfTheBake) {
  const BlobFiles files(small_scene());
  const v1::WorkerReport diverged = reports_of(files.order(kFails)).back();
  EXPECT_EQ(diverged.failed().code(), grpc::StatusCode::INTERNAL);
  EXPECT_EQ(diverged.failed().message(), "the solver did not converge");
  const v1::WorkerReport too_large = reports_of(files.order(kTakesAllMemory)).back();
  EXPECT_EQ(too_large.failed().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(too_large.failed().message(), HasSubstr("needs more memory"));
}

TEST(RunWorker, StopsTheBakeWhenItIsCancelled) {
  const BlobFiles files(small_scene());
  Reports reports;
  const int exit_code = run_against([&](WorkerStream& stream) {
    stream.Write(files.order(kWaitsForStop));
    v1::WorkerCommand cancel;
    cancel.mutable_cancel();
    stream.Write(cancel);
    reports = read_to_outcome(stream);
    accept(stream);
  });
  EXPECT_EQ(exit_code, worker::kExitDone);
  ASSERT_TRUE(reports.back().has_cancelled());
  EXPECT_EQ(reports.back().cancelled().code(), grpc::StatusCode::CANCELLED);
}

TEST(RunWorker, EndsTheBakeWithWhatItHasWhenItIsAskedTo) {
  const BlobFiles files(small_scene());
  Reports reports;
  const int exit_code = run_against([&](WorkerStream& stream) {
    stream.Write(files.order(kWaitsForFinish));
    v1::WorkerCommand finish;
    finish.mutable_finish();
    stream.Write(finish);
    reports = read_to_outcome(stream);
    accept(stream);
  });
  EXPECT_EQ(exit_code, worker::kExitDone);
  ASSERT_TRUE(reports.back().has_bake_finished());
  EXPECT_EQ(reports.back().bake_finished().layers_size(), 1);
}

TEST(RunWorker, StopsABakeThatWasToFinishWhenItIsCancelled) {
  const BlobFiles files(small_scene());
  Reports reports;
  run_against([&](WorkerStream& stream) {
    stream.Write(files.order(kWaitsForStop));
    v1::WorkerCommand command;
    command.mutable_finish();
    stream.Write(command);
    command.mutable_cancel();
    stream.Write(command);
    reports = read_to_outcome(stream);
    accept(stream);
  });
  EXPECT_TRUE(reports.back().has_cancelled());
}

TEST(RunWorker, TakesWhatHasGoneByOffTheTimeBudget) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes);
  v1::StartWork& start = *order.mutable_start();
  start.set_waited_seconds(4);
  reports_of(order);
  EXPECT_EQ(fake_time_budget_seconds, 0);  // none stays none
  start.mutable_settings()->set_time_budget_ms(10'000);
  reports_of(order);
  EXPECT_GT(fake_time_budget_seconds, 0);
  EXPECT_LT(fake_time_budget_seconds, 6);  // reading the scene takes time, too
  start.set_waited_seconds(20);
  reports_of(order);
  EXPECT_GT(fake_time_budget_seconds, 0);
  EXPECT_LT(fake_time_budget_seconds, 0.01);
}

TEST(RunWorker, StopsTheBakeWhenTheServerGoes) {
  const BlobFiles files(small_scene());
  const int exit_code = run_against([&](WorkerStream& stream) {
    stream.Write(files.order(kWaitsForStop));
    v1::WorkerReport hello;
    stream.Read(&hello);
  });
  EXPECT_EQ(exit_code, worker::kExitServerGone);
  EXPECT_TRUE(fake_saw_stop);
}

TEST(RunWorker, EndsWhenTheServerGoesBeforeItOrders) {
  EXPECT_EQ(run_against([](WorkerStream&) {}), worker::kExitServerGone);
}

TEST(RunWorker, DoesNotEndWellBeforeTheOutcomeIsStored) {
  const BlobFiles files(small_scene());
  const int exit_code = run_against([&](WorkerStream& stream) {
    stream.Write(files.order(kBakes));
    EXPECT_TRUE(read_to_outcome(stream).back().has_bake_finished());
  });
  EXPECT_EQ(exit_code, worker::kExitServerGone);
}

TEST(RunWorker, IsHeardWhileTheBakeIsSilent) {
  const BlobFiles files(small_scene());
  const Reports reports = reports_of(files.order(kIsSilent));
  const auto is_silent = [](const v1::WorkerReport& report) {
    return report.has_progress() && report.progress().state() == v1::PREPARING && report.progress().fraction() == 0;
  };
  // Three seconds of silence: a heartbeat each second, less one for a machine that is busy.
  EXPECT_GE(std::count_if(reports.begin(), reports.end(), is_silent), 2);
}

TEST(RunWorker, MakesTheBakeWaitForASlowServer) {
  const BlobFiles files(small_scene());
  int num_before_reading = 0;
  Reports reports;
  const int exit_code = run_against([&](WorkerStream& stream) {
    num_fake_tiles = 0;
    stream.Write(files.order(kFloods));
    // Read nothing until the bake has come to a halt.
    while (num_fake_tiles == 0 || num_fake_tiles != num_before_reading) {
      num_before_reading = num_fake_tiles;
      std::this_thread::sleep_for(300ms);
    }
    reports = read_to_outcome(stream);
    accept(stream);
  });
  EXPECT_EQ(exit_code, worker::kExitDone);
  EXPECT_LT(num_before_reading, kNumFloodTiles / 2);
  // Nothing is lost, and the order is kept.
  int num_tiles = 0;
  for (const v1::WorkerReport& report : reports) {
    if (!report.has_tile()) continue;
    float value = 0;
    std::memcpy(&value, report.tile().data().data(), sizeof value);
    EXPECT_EQ(value, static_cast<float>(num_tiles++));
  }
  EXPECT_EQ(num_tiles, kNumFloodTiles);
}

}  // namespace
}  // namespace radbake
