#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "server/worker/run_worker.h"
#include "tests/unit/worker/worker_server.h"

namespace radbake {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Starts a program that inherits all descriptors without close-on-exec, and returns its exit code.
int exit_code_of(const std::vector<std::string>& command) {
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t pid = 0;
  if (::posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ) != 0) return -1;
  int status = 0;
  ::waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string output_of(const std::string& command) {
  std::string output;
  FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
    output.append(buffer.data(), count);
  ::pclose(pipe);
  return output;
}

TEST(WorkerProcess, BakesOverAnInheritedSocket) {
  const BlobFiles files(small_scene());
  std::vector<v1::WorkerReport> reports;
  const WorkerServer server([&](WorkerStream& stream) {
    stream.Write(files.order(kBakes));
    reports = read_to_outcome(stream);
    accept(stream);
  });
  const int code = exit_code_of(
      {FAKE_WORKER, "--fd", std::to_string(server.worker_fd()), "--job", "bakes/1", "--attempt", "2", "--log-json"});
  ::close(server.worker_fd());
  EXPECT_EQ(code, worker::kExitDone);
  ASSERT_FALSE(reports.empty());
  EXPECT_EQ(reports.front().hello().job(), "bakes/1");
  EXPECT_EQ(reports.front().hello().attempt(), 2U);
  ASSERT_TRUE(reports.back().has_bake_finished());
  const v1::RunReport& run = reports.back().bake_finished().report().run();
  EXPECT_GE(run.worker_start_seconds(), 0);
  // The kernel's ticks are 10 ms: a start of minutes would be a misread field.
  EXPECT_LT(run.worker_start_seconds(), 60);
}

TEST(WorkerProcess, BakesWithTheRealLibrary) {
  const BlobFiles files(small_scene());
  v1::WorkerCommand order = files.order(kBakes);
  order.mutable_start()->mutable_settings()->set_atlas_size(64);
  order.mutable_start()->mutable_settings()->set_rays(8);
  using Clock = std::chrono::steady_clock;
  const auto spawned_at = Clock::now();
  Clock::duration time_to_hello{};
  std::vector<v1::WorkerReport> reports;
  const WorkerServer server([&](WorkerStream& stream) {
    reports.emplace_back();
    stream.Read(&reports.back());
    time_to_hello = Clock::now() - spawned_at;
    stream.Write(order);
    for (v1::WorkerReport& report : read_to_outcome(stream)) reports.push_back(std::move(report));
    accept(stream);
  });
  const int code =
      exit_code_of({REAL_WORKER, "--fd", std::to_string(server.worker_fd()), "--job", "bakes/1", "--attempt", "1"});
  ::close(server.worker_fd());
  EXPECT_EQ(code, worker::kExitDone);
  ASSERT_GE(reports.size(), 2U);
  EXPECT_TRUE(reports.front().has_hello());
  // For people: how fast a worker comes up.
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(time_to_hello);
  RecordProperty("milliseconds_to_hello", static_cast<int>(milliseconds.count()));

  ASSERT_TRUE(reports.back().has_bake_finished()) << reports.back().ShortDebugString();
  const v1::BakeResult& result = reports.back().bake_finished();
  EXPECT_EQ(result.layers(0).width(), 64U);
  EXPECT_EQ(result.layers(0).blob().size_bytes(), 64U * 64 * 4 * 4);
  EXPECT_EQ(result.report().lightmap().atlas_size(), 64U);
  EXPECT_GT(result.report().energy().mean_irradiance(), 0);
  int num_tiles = 0;
  for (const v1::WorkerReport& report : reports) {
    if (!report.has_tile()) continue;
    ++num_tiles;
    const v1::LayerTile& tile = report.tile();
    EXPECT_EQ(tile.layer_name(), result.layers(0).name());
    EXPECT_EQ(tile.layer_width(), 64U);
    EXPECT_EQ(tile.layer_height(), 64U);
    EXPECT_EQ(tile.data().size(), std::size_t{4} * tile.channels() * tile.width() * tile.height());
  }
  EXPECT_GT(num_tiles, 0);
}

TEST(WorkerProcess, RefusesAWrongCommandLine) {
  EXPECT_EQ(exit_code_of({FAKE_WORKER, "--fd", "5"}), worker::kExitUsage);
  EXPECT_EQ(exit_code_of({FAKE_WORKER, "--fd", "-1", "--job", "j", "--attempt", "1"}), worker::kExitUsage);
}

TEST(WorkerProcess, TellsItsVersion) {
  EXPECT_THAT(output_of(std::string(REAL_WORKER) + " --version"), HasSubstr("radbake-worker 0."));
}

TEST(WorkerProcess, LoadsNoImageLibrary) {
  // Loading it takes ten times as long as the rest of the start.
  const std::string libraries = output_of(std::string("ldd ") + REAL_WORKER);
  EXPECT_THAT(libraries, HasSubstr("libgrpc++"));
  EXPECT_THAT(libraries, HasSubstr("libembree3"));
  EXPECT_THAT(libraries, Not(HasSubstr("OpenImageIO")));
}

}  // namespace
}  // namespace radbake
