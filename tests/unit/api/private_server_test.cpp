#include "client/api/private_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>

namespace radbake::api {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

/// Runs shell scripts in place of the server, with their temporary folder here.
class PrivateServerStart : public testing::Test {
 protected:
  void SetUp() override {
    std::string path = (fs::temp_directory_path() / "private-server-test-XXXXXX").string();
    folder_ = mkdtemp(path.data());
    fs::create_directory(folder_ / "tmp");
    setenv("TMPDIR", (folder_ / "tmp").c_str(), 1);
  }
  void TearDown() override {
    unsetenv("TMPDIR");
    fs::remove_all(folder_);
  }

  PrivateServer::Options script(const std::string& body) {
    PrivateServer::Options options;
    options.program = folder_ / "radbaked";
    std::ofstream(options.program) << "#!/bin/sh\n" << body;
    fs::permissions(options.program, fs::perms::owner_all);
    return options;
  }

  std::vector<std::string> left_behind() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / "tmp")) names.push_back(entry.path().filename());
    return names;
  }

  fs::path folder_;
};

constexpr char kServes[] = "echo \"radbaked 1.0 listening on $2\"; exec sleep 1000\n";

TEST_F(PrivateServerStart, HandsOnTheFileOfCostsThatOutlivesIt) {
  const fs::path seen = folder_ / "arguments";
  const std::string notes_arguments = "echo \"$*\" > " + seen.string() + "\n";
  const auto arguments = [&] {
    std::ifstream file(seen);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  PrivateServer::Options options = script(notes_arguments + kServes);
  ASSERT_TRUE(PrivateServer::start(options).ok());
  EXPECT_THAT(arguments(), testing::Not(HasSubstr("--costs")));
  options.costs = folder_ / "cache" / "costs";
  ASSERT_TRUE(PrivateServer::start(options).ok());
  EXPECT_THAT(arguments(), HasSubstr("--costs " + options.costs.string()));
}

TEST_F(PrivateServerStart, StopsTheServerAndRemovesItsFolder) {
  Result<PrivateServer> started = PrivateServer::start(script(kServes));
  ASSERT_TRUE(started.ok()) << started.error().message;
  std::optional<PrivateServer> server(std::move(started).value());
  const pid_t pid = server->pid();
  EXPECT_EQ(kill(pid, 0), 0);
  EXPECT_EQ(server->address(), "unix:" + (server->folder() / "socket").string());
  struct stat status {};
  ASSERT_EQ(stat(server->folder().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
  server.reset();
  EXPECT_EQ(kill(pid, 0), -1);
  EXPECT_EQ(errno, ESRCH);
  EXPECT_THAT(left_behind(), IsEmpty());
}

TEST_F(PrivateServerStart, ShowsTheLogOfAServerThatFails) {
  const Result<PrivateServer> server = PrivateServer::start(script("echo 'no space left' >&2; exit 1\n"));
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(server.error().message, HasSubstr("ended before it listened"));
  EXPECT_THAT(server.error().message, HasSubstr("no space left"));
  EXPECT_THAT(left_behind(), IsEmpty());
}

TEST_F(PrivateServerStart, DoesNotWaitForASilentServerForEver) {
  PrivateServer::Options options = script("exec sleep 1000\n");
  options.start_limit = std::chrono::milliseconds(100);
  const Result<PrivateServer> server = PrivateServer::start(options);
  ASSERT_FALSE(server.ok());
  EXPECT_THAT(server.error().message, HasSubstr("did not start within 100 ms"));
  EXPECT_THAT(left_behind(), IsEmpty());
}

TEST_F(PrivateServerStart, KillsAServerThatDoesNotObey) {
  PrivateServer::Options options =
      script("trap '' TERM; echo \"radbaked 1.0 listening on $2\"; while :; do sleep 0.1; done\n");
  options.stop_limit = std::chrono::milliseconds(100);
  Result<PrivateServer> started = PrivateServer::start(options);
  ASSERT_TRUE(started.ok()) << started.error().message;
  std::optional<PrivateServer> server(std::move(started).value());
  const pid_t pid = server->pid();
  server.reset();
  EXPECT_EQ(kill(pid, 0), -1);
  EXPECT_THAT(left_behind(), IsEmpty());
}

TEST_F(PrivateServerStart, NamesAProgramThatCannotBeStarted) {
  PrivateServer::Options options;
  options.program = folder_ / "nowhere";
  const Result<PrivateServer> server = PrivateServer::start(options);
  ASSERT_FALSE(server.ok());
  EXPECT_THAT(server.error().message, HasSubstr("nowhere"));
}

}  // namespace
}  // namespace radbake::api
