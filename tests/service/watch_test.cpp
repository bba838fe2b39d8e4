#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using namespace std::chrono_literals;

class WatchTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  TestServer server_{TestServer::options_in(folder_.path())};
  TestClient client_ = server_.client();
};

std::vector<v1::BakeState> states_of(const std::vector<v1::BakeEvent>& events) {
  std::vector<v1::BakeState> states;
  for (const v1::BakeEvent& event : events) states.push_back(event.state());
  return states;
}

const std::vector<v1::BakeState> kAllStates = {v1::QUEUED,    v1::PREPARING, v1::FORM_FACTORS, v1::SOLVING,
                                               v1::GATHERING, v1::WRITING,   v1::SUCCEEDED};

TEST_F(WatchTest, ShowsEveryEventOnceFromTheFirstOn) {
  const auto watched = client_.watch(client_.submit(kSucceed).name());
  ASSERT_TRUE(watched.status.ok()) << watched.status.error_message();
  ASSERT_TRUE(watched.messages.front().has_snapshot());
  const auto events = watched.events();
  EXPECT_EQ(states_of(events), kAllStates);
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].sequence(), i + 1);
    EXPECT_GT(events[i].unix_ms(), 0);
  }
  EXPECT_EQ(watched.finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(watched.finished().last_sequence(), events.size());
}

TEST_F(WatchTest, GoesOnAfterASequenceNumber) {
  const std::string name = client_.submit(kSucceed).name();
  client_.wait_for(name, v1::SUCCEEDED);
  const auto watched = client_.watch(name, 3);
  EXPECT_EQ(states_of(watched.events()), std::vector<v1::BakeState>(kAllStates.begin() + 3, kAllStates.end()));
  EXPECT_EQ(watched.finished().result().layers_size(), 1);
}

TEST_F(WatchTest, GivesEachOfTwoWatchersEveryTile) {
  constexpr unsigned kTiles = 200;
  // The first watcher is there from the beginning, the second comes while the bake runs or after it.
  const v1::Bake blocker = client_.submit(kRunUntilCancelled);
  const std::string name = client_.submit(kSucceed, kTiles).name();
  auto first = std::async(std::launch::async, [&] { return server_.client().watch(name, 0, true); });
  auto second = std::async(std::launch::async, [&] { return server_.client().watch(name, 0, true, 1ms); });
  client_.cancel(blocker.name());
  for (auto* watcher : {&first, &second}) {
    const auto watched = watcher->get();
    ASSERT_TRUE(watched.status.ok()) << watched.status.error_message();
    const auto tiles = watched.tiles();
    ASSERT_EQ(tiles.size(), kTiles);
    for (unsigned i = 0; i < kTiles; ++i) {
      EXPECT_EQ(tiles[i].y(), i * kTileSize);
      EXPECT_EQ(tiles[i].data().size(), kTileSize * kTileSize * kFakeChannels * sizeof(float));
    }
    EXPECT_EQ(watched.finished().state(), v1::SUCCEEDED);
  }
}

TEST_F(WatchTest, ShowsTheTilesOfANewAttemptFromTheFirstOn) {
  constexpr unsigned kTiles = 4;
  v1::WatchBakeRequest request;
  request.set_name(client_.submit(kDieAfterTiles, kTiles).name());
  request.set_include_tiles(true);
  const auto context = new_context();
  const auto stream = client_.bakes->WatchBake(context.get(), request);
  std::vector<unsigned> tiles;
  v1::WatchBakeResponse message;
  while (stream->Read(&message)) {
    if (!message.has_tile()) continue;
    tiles.push_back(message.tile().y() / kTileSize);
    // All of the first attempt have been seen: now it may die.
    if (tiles.size() != kTiles / 2) continue;
    EXPECT_TRUE(client_.finish(request.name()).ok());
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(message.finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(tiles, (std::vector<unsigned>{0, 1, 0, 1, 2, 3}));
}

TEST_F(WatchTest, SendsNoTilesUnlessAsked) {
  EXPECT_TRUE(client_.watch(client_.submit(kSucceed).name()).tiles().empty());
}

TEST_F(WatchTest, LosesNoEventForASlowWatcherAndDoesNotHoldUpTheBake) {
  const std::string name = client_.submit(kRunUntilCancelled).name();
  auto slow = std::async(std::launch::async, [&] { return server_.client().watch(name, 0, false, 30ms); });
  auto quick = std::async(std::launch::async, [&] { return server_.client().watch(name); });
  client_.wait_for(name, v1::FORM_FACTORS);
  std::this_thread::sleep_for(500ms);  // some dozens of reports of progress
  client_.cancel(name);
  EXPECT_EQ(quick.get().finished().state(), v1::CANCELLED);
  const auto watched = slow.get();
  EXPECT_EQ(watched.events().size(), watched.finished().last_sequence());
}

TEST_F(WatchTest, SurvivesWatchersThatLeave) {
  const std::string name = client_.submit(kRunUntilCancelled).name();
  for (int i = 0; i < 20; ++i) {
    v1::WatchBakeRequest request;
    request.set_name(name);
    const auto context = new_context();
    const auto stream = client_.bakes->WatchBake(context.get(), request);
    v1::WatchBakeResponse message;
    if (i % 2 == 0) {
      EXPECT_TRUE(stream->Read(&message));
    }
    context->TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
  }
  ASSERT_TRUE(client_.cancel(name).ok());
  EXPECT_EQ(client_.watch(name).finished().state(), v1::CANCELLED);
}

TEST_F(WatchTest, EndsWithUnavailableWhenTheServerStops) {
  const std::string name = client_.submit(kRunUntilCancelled).name();
  client_.wait_for(name, v1::FORM_FACTORS);
  auto watched = std::async(std::launch::async, [&] { return server_.client().watch(name); });
  // The watcher must be there before the server goes.
  std::this_thread::sleep_for(200ms);
  server_.server().stop();
  EXPECT_EQ(watched.get().status.error_code(), grpc::UNAVAILABLE);
}

}  // namespace
}  // namespace radbake::testing
