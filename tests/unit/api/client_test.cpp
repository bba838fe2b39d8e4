#include "client/api/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "common/base/version.h"
#include "tests/unit/api/fake_server.h"
#include "tests/unit/api/impatient.h"

namespace radbake::api {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

TEST(Client, TellsItsProtocolVersionWithEachCall) {
  FakeServer server;
  ASSERT_TRUE(Client::connect(server.address(), impatient()).ok());
  EXPECT_EQ(server.protocol, std::to_string(kProtocolMajor));
}

TEST(Client, RefusesAServerOfAnotherProtocolVersion) {
  FakeServer server;
  server.capabilities.set_protocol_major(kProtocolMajor + 1);
  const Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(client.error().message, HasSubstr("speaks protocol " + std::to_string(kProtocolMajor + 1)));
  EXPECT_THAT(client.error().message, HasSubstr("speaks protocol " + std::to_string(kProtocolMajor) + ":"));
}

TEST(Client, NamesTheServerThatCannotBeReached) {
  const Result<Client> client = Client::connect("unix:/nonexistent/socket", impatient());
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(client.error().message, HasSubstr("unix:/nonexistent/socket cannot be reached"));
}

TEST(Client, TriesAgainWhileTheServerIsAway) {
  FakeServer server;
  server.calls_to_refuse = 3;
  EXPECT_TRUE(Client::connect(server.address(), impatient()).ok());
  EXPECT_EQ(server.calls_to_refuse, 0);
}

TEST(Client, RepeatsASubmitUnderOneRequestId) {
  FakeServer server;
  Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_TRUE(client.ok());
  server.calls_to_refuse = 2;
  v1::SubmitBakeRequest request;
  request.set_request_id(make_request_id());
  request.set_label("scene.glb");
  const Result<v1::Bake> bake = client->submit(request);
  ASSERT_TRUE(bake.ok()) << bake.error().message;
  EXPECT_EQ(bake->label(), "scene.glb");
  EXPECT_THAT(server.request_ids, SizeIs(3));
  EXPECT_THAT(server.request_ids, Each(request.request_id()));
}

TEST(Client, PassesOnTheServersRefusal) {
  FakeServer server;
  Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_TRUE(client.ok());
  server.submit_status = {grpc::StatusCode::INVALID_ARGUMENT, "atlas_size 100 is not a power of two"};
  const Result<v1::Bake> bake = client->submit({});
  ASSERT_FALSE(bake.ok());
  EXPECT_EQ(bake.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bake.error().message, "atlas_size 100 is not a power of two");
}

TEST(Client, ListsAllPages) {
  FakeServer server;
  server.num_bakes = 5;
  server.page_size = 2;
  Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_TRUE(client.ok());
  const Result<std::vector<v1::Bake>> bakes = client->list();
  ASSERT_TRUE(bakes.ok());
  std::vector<std::string> names;
  for (const v1::Bake& bake : *bakes) names.push_back(bake.name());
  EXPECT_THAT(names, ElementsAre("bakes/0", "bakes/1", "bakes/2", "bakes/3", "bakes/4"));
}

TEST(Client, SaysWhichBakeIsUnknown) {
  FakeServer server;
  Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_TRUE(client.ok());
  const Result<v1::Bake> bake = client->get("bakes/7");
  ASSERT_FALSE(bake.ok());
  EXPECT_EQ(bake.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(bake.error().message, HasSubstr("bakes/7"));
}

TEST(Client, AsksABakeToFinishUntilTheServerHears) {
  FakeServer server;
  Result<Client> client = Client::connect(server.address(), impatient());
  ASSERT_TRUE(client.ok());
  server.calls_to_refuse = 1;
  const Result<v1::Bake> bake = client->finish("bakes/7");
  ASSERT_TRUE(bake.ok()) << bake.error().message;
  EXPECT_EQ(bake->name(), "bakes/7");
  EXPECT_THAT(server.to_finish, ElementsAre("bakes/7", "bakes/7"));
}

TEST(RequestId, IsFreshEachTime) {
  std::set<std::string> ids;
  for (int i = 0; i < 100; ++i) ids.insert(make_request_id());
  EXPECT_THAT(ids, SizeIs(100));
  EXPECT_THAT(ids, Each(SizeIs(32)));
}

}  // namespace
}  // namespace radbake::api
