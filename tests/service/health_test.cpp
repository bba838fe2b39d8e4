// Whether the server takes work, as health, /readyz and refusals say it.

#include "tests/service/health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "google/rpc/error_details.pb.h"
#include "server/store/sqlite.h"
#include "tests/service/admin_page.h"
#include "tests/service/server_program.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kFloor = 1000;

TEST(Health, ServesAndIsReadyWhenIdle) {
  const TemporaryFolder folder;
  auto options = TestServer::options_in(folder.path());
  options.admin_listen = "127.0.0.1:0";
  TestServer server(options);
  const std::string admin = server.server().admin_address();
  EXPECT_EQ(health_of(server.client()), Health::kServing);
  EXPECT_EQ(health_of(server.client(), "radbake.v1.Bakes"), Health::kServing);
  EXPECT_EQ(get_page(admin, "/livez").status, 200);
  EXPECT_EQ(get_page(admin, "/readyz").text, "ok\n");
  EXPECT_EQ(get_page(admin, "/").status, 404);
}

TEST(Health, HasNoAdminPortUnlessOneIsNamed) {
  const TemporaryFolder folder;
  TestServer server(TestServer::options_in(folder.path()));
  EXPECT_EQ(server.server().admin_address(), "");
}

TEST(Health, RefusesAnAdminPortInUse) {
  const TemporaryFolder folder, other;
  auto options = TestServer::options_in(folder.path());
  options.admin_listen = "127.0.0.1:0";
  TestServer server(options);
  auto second = TestServer::options_in(other.path());
  second.admin_listen = server.server().admin_address();
  const auto refused = service::BakeServer::start(second);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("admin-listen is '" + second.admin_listen + "'"));
}

/// A server whose disk has as much room as the test says.
struct ServerOnADisk {
  TemporaryFolder folder;
  std::atomic<std::uint64_t> free_bytes = kFloor;
  std::unique_ptr<TestServer> server;

  ServerOnADisk() {
    auto options = TestServer::options_in(folder.path());
    options.admin_listen = "127.0.0.1:0";
    options.limits.min_free_disk_bytes = kFloor;
    options.disk.interval = std::chrono::milliseconds(5);
    options.disk.probe = [this](const std::filesystem::path&) -> Result<std::uint64_t> {
      const std::uint64_t free = free_bytes;
      if (free == 0) return internal_error("the disk has gone");
      return free;
    };
    server = std::make_unique<TestServer>(options);
  }
  std::string readyz() const { return get_page(server->server().admin_address(), "/readyz").text; }
};

TEST(Health, RefusesUploadsAndSubmitsWhileTheDiskIsTooFullAndRecovers) {
  ServerOnADisk disk;
  TestClient client = disk.server->client();
  const v1::Digest scene = client.upload_scene();

  disk.free_bytes = kFloor - 1;
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_THAT(disk.readyz(), HasSubstr("disk_full: 999 bytes are free"));
  v1::Bake bake;
  for (const grpc::Status& refused :
       {client.upload("new bytes"),
        client.bakes->SubmitBake(new_context().get(), client.request_for(scene, kSucceed), &bake)}) {
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("min_free_disk_bytes is 1000"));
    const auto quota = detail_of<google::rpc::QuotaFailure>(refused);
    ASSERT_TRUE(quota);
    EXPECT_EQ(quota->violations(0).subject(), "min_free_disk_bytes");
  }
  // What needs no room goes on.
  v1::UploadResult present;
  EXPECT_TRUE(client.upload(std::string(5000, 'm'), &present).ok());
  EXPECT_TRUE(present.already_present());

  disk.free_bytes = kFloor;
  EXPECT_TRUE(becomes(client, Health::kServing));
  EXPECT_EQ(disk.readyz(), "ok\n");
  EXPECT_TRUE(client.upload("new bytes").ok());
  EXPECT_EQ(client.watch(client.submit(kSucceed).name()).finished().state(), v1::SUCCEEDED);
}

TEST(Health, IsNotServingWhenTheDiskCannotBeLookedAt) {
  ServerOnADisk disk;
  TestClient client = disk.server->client();
  disk.free_bytes = 0;
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_THAT(disk.readyz(), HasSubstr("the disk has gone"));
  disk.free_bytes = kFloor;
  EXPECT_TRUE(becomes(client, Health::kServing));
}

TEST(Health, SaysWhatTheDiskRefusedUntilItTakesItAgain) {
  const TemporaryFolder folder;
  std::atomic<bool> is_refusing = true;
  service::Readiness readiness;
  readiness.clear(service::Obstacle::kRecovering);
  service::DiskWatchOptions options;
  options.folder = folder.path();
  options.interval = std::chrono::milliseconds(1);
  options.problem = [&] { return is_refusing ? std::string("fsync: Input/output error") : std::string(); };
  const service::DiskWatch watch(options, readiness);
  EXPECT_EQ(readiness.why_not(), "standstill: fsync: Input/output error\n");
  EXPECT_TRUE(watch.admit().ok());
  is_refusing = false;
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  while (!readiness.is_ready() && std::chrono::steady_clock::now() < limit) std::this_thread::yield();
  EXPECT_TRUE(readiness.is_ready());
}

/// A file system of its own with few bytes.
class SmallDisk {
 public:
  SmallDisk() { is_mounted_ = ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, "size=8m") == 0; }
  ~SmallDisk() {
    if (is_mounted_) ::umount2(folder_.path().c_str(), MNT_DETACH);
  }
  bool is_mounted() const { return is_mounted_; }
  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
  bool is_mounted_ = false;
};

TEST(Health, FollowsARealDiskThatFillsAndIsEmptied) {
  const SmallDisk disk;
  if (!disk.is_mounted()) GTEST_SKIP() << "needs the right to mount a tmpfs";
  const TemporaryFolder sockets;
  auto options = TestServer::options_in(sockets.path());
  options.data = disk.path() / "data";
  options.limits.min_free_disk_bytes = 4 << 20;
  options.disk.interval = std::chrono::milliseconds(5);
  TestServer server(options);
  TestClient client = server.client();
  EXPECT_EQ(health_of(client), Health::kServing);

  const std::filesystem::path ballast = disk.path() / "ballast";
  std::ofstream(ballast) << std::string(5 << 20, 'b');
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_EQ(client.upload("new bytes").error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  std::filesystem::remove(ballast);
  EXPECT_TRUE(becomes(client, Health::kServing));
  EXPECT_TRUE(client.upload("new bytes").ok());
}

TEST(Health, IsAliveButNotReadyWhileItTakesUpOldBakes) {
  const TemporaryFolder folder;
  const std::vector<std::string> arguments = {"--listen",       "unix:" + (folder.path() / "socket").string(),
                                              "--data",         (folder.path() / "data").string(),
                                              "--worker",       RADBAKE_FAKE_WORKER,
                                              "--admin-listen", "127.0.0.1:0"};
  std::string name;
  {
    ServerProgram program(arguments);
    TestClient client(program.wait_for_address());
    name = client.submit(kSucceedSecondTime).name();
    EXPECT_EQ(client.wait_for(name, v1::FORM_FACTORS).state(), v1::FORM_FACTORS);
    program.end(SIGKILL);
  }
  // Who holds the database keeps the next server from recording that the bake is queued again.
  auto database = store::Database::open(folder.path() / "data" / "jobs.sqlite");
  ASSERT_TRUE(database.ok()) << database.error().message;
  ASSERT_TRUE(database->execute("BEGIN IMMEDIATE").ok());
  ServerProgram program(arguments);
  const std::string admin = program.wait_for("the admin port is ");
  TestClient client(arguments[1]);
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_EQ(get_page(admin, "/livez").status, 200);
  const AdminPage ready = get_page(admin, "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_THAT(ready.text, HasSubstr("recovering: "));
  EXPECT_EQ(metric(get_page(admin, "/metrics").text, "radbake_obstacle{reason=\"recovering\"}"), 1);
  v1::GetBakeRequest request;
  request.set_name(name);
  v1::Bake bake;
  const grpc::Status refused = client.bakes->GetBake(new_context().get(), request, &bake);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(detail_of<google::rpc::RetryInfo>(refused));

  ASSERT_TRUE(database->execute("COMMIT").ok());
  EXPECT_EQ(program.wait_for_address(), arguments[1]);
  EXPECT_EQ(program.wait_for(" admin on "), admin);
  EXPECT_EQ(health_of(client), Health::kServing);
  EXPECT_EQ(get_page(admin, "/readyz").status, 200);
  EXPECT_EQ(client.watch(name).finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(program.end(SIGTERM), 0);
}

TEST(Health, TellsTheServiceManagerWhenItIsReadyAndWhenItStops) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "notify").string();
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  const timeval limit{kCallLimit.count(), 0};
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
  const auto next = [&] {
    char message[64] = {};
    return recv(socket, message, sizeof(message) - 1, 0) < 0 ? "nothing" : std::string(message);
  };
  ServerProgram program({"--listen", "unix:" + (folder.path() / "socket").string(), "--data",
                         (folder.path() / "data").string(), "--worker", RADBAKE_FAKE_WORKER},
                        {"NOTIFY_SOCKET=" + path});
  EXPECT_EQ(next(), "READY=1");
  EXPECT_NE(program.wait_for_address(), "");
  EXPECT_EQ(program.end(SIGTERM), 0);
  EXPECT_EQ(next(), "STOPPING=1");
  close(socket);
}

}  // namespace
}  // namespace radbake::testing
