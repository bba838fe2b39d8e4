// What /metrics says of bakes, calls and the process.

#include <gmock/gmock.h>
#include <grpcpp/impl/codegen/client_unary_call.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/version.h"
#include "tests/service/admin_page.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class MetricsTest : public ::testing::Test {
 protected:
  MetricsTest() : server_(options()), client_(server_.client()) {}

  service::BakeServerOptions options() const {
    auto options = TestServer::options_in(folder_.path());
    options.admin_listen = "127.0.0.1:0";
    options.limits.max_queued_bakes = 7;
    return options;
  }
  std::string page() { return get_page(server_.server().admin_address(), "/metrics").text; }
  double value(const std::string& name) { return metric(page(), name); }
  /// A count follows what it counts, a moment later.
  bool becomes(const std::string& name, double wanted) {
    const auto limit = std::chrono::steady_clock::now() + kCallLimit;
    while (value(name) != wanted) {
      if (std::chrono::steady_clock::now() > limit) return false;
    }
    return true;
  }

  TemporaryFolder folder_;
  TestServer server_;
  TestClient client_;
};

TEST_F(MetricsTest, BeginsCountersAtZeroAndSaysWhatRuns) {
  const std::string text = page();
  for (const char* name :
       {"radbake_bakes_ended_total{state=\"succeeded\"}", "radbake_bakes_ended_total{state=\"failed\"}",
        "radbake_attempts_ended_total{reason=\"worker_died\"}", "radbake_rays_total",
        "radbake_cache_lookups_total{result=\"hit\"}", "radbake_cache_lookups_total{result=\"miss\"}",
        "radbake_waiting_bakes", "radbake_running_bakes", "radbake_running_plans", "radbake_upload_bytes",
        "radbake_obstacle{reason=\"recovering\"}", "radbake_obstacle{reason=\"disk_full\"}",
        "radbake_obstacle{reason=\"draining\"}"}) {
    EXPECT_EQ(metric(text, name), 0) << name;
  }
  EXPECT_EQ(metric(text, "radbake_ready"), 1);
  EXPECT_EQ(metric(text, "radbake_max_queued_bakes"), 7);
  EXPECT_THAT(text, HasSubstr(std::string("radbake_build_info{")));
  EXPECT_THAT(text, HasSubstr(std::string("version=\"") + kEngineVersion + "\""));
}

TEST_F(MetricsTest, GivesEveryMetricAHelpTextAndTheProgramsName) {
  client_.watch(client_.submit(kSucceed).name());
  std::istringstream lines(page());
  std::string line, last_help;
  int num_metrics = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("# HELP ")) last_help = line.substr(7);
    if (!line.starts_with("# TYPE ")) continue;
    const std::string name = line.substr(7, line.find(' ', 7) - 7);
    EXPECT_TRUE(name.starts_with("radbake_")) << name;
    EXPECT_TRUE(last_help.starts_with(name + " ") && last_help.size() > name.size() + 1) << name;
    ++num_metrics;
  }
  EXPECT_GT(num_metrics, 20);
}

TEST_F(MetricsTest, CountsABakeItsStagesAndItsRays) {
  EXPECT_EQ(client_.watch(client_.submit(kSucceed).name()).finished().state(), v1::SUCCEEDED);
  EXPECT_TRUE(becomes("radbake_attempts_ended_total{reason=\"outcome\"}", 1));
  const std::string text = page();
  EXPECT_EQ(metric(text, "radbake_bakes_ended_total{state=\"succeeded\"}"), 1);
  for (const char* stage : {"queued", "preparing", "form_factors", "solving", "gathering", "writing"}) {
    EXPECT_EQ(metric(text, std::string("radbake_stage_seconds_count{stage=\"") + stage + "\"}"), 1) << stage;
  }
  EXPECT_EQ(metric(text, "radbake_rays_total"), kFakeRays);
  EXPECT_EQ(metric(text, "radbake_last_bake_rays_per_second"), kFakeRaysPerSecond);
}

TEST_F(MetricsTest, CountsSubmitsThatAnotherBakeAnswers) {
  const std::string hits = "radbake_cache_lookups_total{result=\"hit\"}";
  const std::string misses = "radbake_cache_lookups_total{result=\"miss\"}";
  const std::string name = client_.submit(kSucceed).name();
  EXPECT_EQ(client_.watch(name).finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(value(hits), 0);
  EXPECT_EQ(value(misses), 1);
  // Done: answered from the store, and no bake more has run.
  client_.submit(kSucceed);
  EXPECT_EQ(value(hits), 1);
  EXPECT_EQ(value("radbake_bakes_ended_total{state=\"succeeded\"}"), 1);
  // Under way: shares the run.
  client_.submit(kRunUntilCancelled);
  client_.submit(kRunUntilCancelled);
  EXPECT_EQ(value(hits), 2);
  EXPECT_EQ(value(misses), 2);
}

TEST_F(MetricsTest, CountsWorkersThatDieAndBakesThatWereCancelled) {
  EXPECT_EQ(client_.watch(client_.submit(kCrash).name()).finished().state(), v1::FAILED);
  EXPECT_TRUE(becomes("radbake_attempts_ended_total{reason=\"worker_died\"}", 3));  // it is tried again
  EXPECT_TRUE(becomes("radbake_bakes_ended_total{state=\"failed\"}", 1));
  const std::string stubborn = client_.submit(kIgnoreCancel).name();
  client_.wait_for(stubborn, v1::FORM_FACTORS);
  EXPECT_TRUE(client_.cancel(stubborn).ok());
  EXPECT_TRUE(becomes("radbake_bakes_ended_total{state=\"cancelled\"}", 1));
  EXPECT_TRUE(becomes("radbake_attempts_ended_total{reason=\"cancelled\"}", 1));
}

TEST_F(MetricsTest, ShowsWhatRunsAndWhatWaits) {
  const std::string running = client_.submit(kRunUntilCancelled).name();
  client_.wait_for(running, v1::FORM_FACTORS);
  client_.submit(kSucceed);
  const std::string text = page();
  EXPECT_EQ(metric(text, "radbake_running_bakes"), 1);
  EXPECT_EQ(metric(text, "radbake_waiting_bakes"), 1);
  EXPECT_TRUE(client_.cancel(running).ok());
  EXPECT_TRUE(becomes("radbake_bakes_ended_total{state=\"succeeded\"}", 1));
  EXPECT_TRUE(becomes("radbake_running_bakes", 0));
  EXPECT_EQ(value("radbake_waiting_bakes"), 0);
}

TEST_F(MetricsTest, CountsCallsByMethodAndCode) {
  client_.get(client_.submit(kSucceed).name());
  v1::Bake bake;
  v1::GetBakeRequest request;
  request.set_name("bakes/none");
  EXPECT_EQ(client_.bakes->GetBake(new_context().get(), request, &bake).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(becomes("radbake_rpcs_total{code=\"OK\",method=\"radbake.v1.Bakes/GetBake\"}", 1));
  EXPECT_TRUE(becomes("radbake_rpcs_total{code=\"NOT_FOUND\",method=\"radbake.v1.Bakes/GetBake\"}", 1));
  EXPECT_TRUE(becomes("radbake_rpcs_total{code=\"OK\",method=\"radbake.v1.Content/Upload\"}", 2));
  EXPECT_EQ(value("radbake_rpc_seconds_count{method=\"radbake.v1.Bakes/GetBake\"}"), 2);
}

TEST_F(MetricsTest, KnowsTheWatchesThatAreOpen) {
  const std::string open = "radbake_rpcs_open{method=\"radbake.v1.Bakes/WatchBake\"}";
  const std::string name = client_.submit(kRunUntilCancelled).name();
  v1::WatchBakeRequest request;
  request.set_name(name);
  constexpr int kNumWatches = 5;
  {
    std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
    std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchBakeResponse>>> readers;
    for (int i = 0; i < kNumWatches; ++i) {
      contexts.push_back(new_context());
      readers.push_back(client_.bakes->WatchBake(contexts.back().get(), request));
    }
    EXPECT_TRUE(becomes(open, kNumWatches));
    for (int i = 0; i < kNumWatches; ++i) {
      contexts[static_cast<std::size_t>(i)]->TryCancel();
      v1::WatchBakeResponse ignored;
      while (readers[static_cast<std::size_t>(i)]->Read(&ignored)) continue;
      EXPECT_FALSE(readers[static_cast<std::size_t>(i)]->Finish().ok());
    }
  }
  EXPECT_TRUE(becomes(open, 0));
  EXPECT_TRUE(becomes("radbake_rpcs_total{code=\"CANCELLED\",method=\"radbake.v1.Bakes/WatchBake\"}", kNumWatches));
}

TEST_F(MetricsTest, LetsNoClientInventALabel) {
  const grpc::internal::RpcMethod method("/radbake.v1.Bakes/Invented", grpc::internal::RpcMethod::NORMAL_RPC);
  v1::Bake bake;
  EXPECT_EQ(
      grpc::internal::BlockingUnaryCall(client_.channel.get(), method, new_context().get(), bake, &bake).error_code(),
      grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_TRUE(becomes("radbake_rpcs_total{code=\"UNIMPLEMENTED\",method=\"other\"}", 1));
  EXPECT_THAT(page(), Not(HasSubstr("Invented")));
}

TEST_F(MetricsTest, CountsBytesOfUploadsThatAreNotComplete) {
  const std::string bytes(3000, 'u');
  const auto context = new_context();
  const auto stream = client_.content->Upload(context.get());
  v1::UploadChunk chunk;
  *chunk.mutable_digest() = digest_message(bytes);
  chunk.set_data(bytes.substr(0, 1000));
  ASSERT_TRUE(stream->Write(chunk));
  EXPECT_TRUE(becomes("radbake_upload_bytes", 1000));
  chunk.set_offset(1000);
  chunk.set_data(bytes.substr(1000));
  chunk.set_finish(true);
  stream->Write(chunk);
  EXPECT_TRUE(finish_upload(*stream).ok());
  EXPECT_EQ(value("radbake_upload_bytes"), 0);
}

TEST_F(MetricsTest, TellsMemoryProcessorDescriptorsAndDisk) {
  const std::string text = page();
  EXPECT_GT(metric(text, "radbake_process_resident_memory_bytes"), 1 << 20);
  EXPECT_GT(metric(text, "radbake_process_cpu_seconds_total"), 0);
  EXPECT_GT(metric(text, "radbake_process_open_fds"), 3);
  EXPECT_GT(metric(text, "radbake_process_max_fds"), metric(text, "radbake_process_open_fds"));
  EXPECT_GT(metric(text, "radbake_disk_free_bytes"), 0);
  EXPECT_GT(metric(text, "radbake_process_start_time_seconds"), 1.6e9);
}

}  // namespace
}  // namespace radbake::testing
