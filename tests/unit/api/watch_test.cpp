#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/api/client.h"
#include "tests/unit/api/fake_server.h"
#include "tests/unit/api/impatient.h"

namespace radbake::api {
namespace {

using testing::ElementsAre;

class Watch : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 1; i <= 5; ++i) {
      server_.events.emplace_back().set_sequence(i);
    }
    Result<Client> connected = Client::connect(server_.address(), impatient());
    ASSERT_TRUE(connected.ok()) << connected.error().message;
    client_ = std::make_unique<Client>(std::move(connected).value());
  }

  Result<v1::Bake> watch(std::uint64_t after_sequence) {
    return client_->watch("bakes/1", {after_sequence, false}, [&](const v1::WatchBakeResponse& response) {
      if (response.has_event()) sequences_.push_back(response.event().sequence());
    });
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
  std::vector<std::uint64_t> sequences_;
};

TEST_F(Watch, ReturnsTheBakeInItsLastState) {
  server_.finished.set_state(v1::FAILED);
  const Result<v1::Bake> bake = watch(0);
  ASSERT_TRUE(bake.ok()) << bake.error().message;
  EXPECT_EQ(bake->state(), v1::FAILED);
  EXPECT_THAT(sequences_, ElementsAre(1u, 2u, 3u, 4u, 5u));
}

TEST_F(Watch, StartsAfterTheSequenceThatItIsGiven) {
  ASSERT_TRUE(watch(3).ok());
  EXPECT_THAT(sequences_, ElementsAre(4u, 5u));
}

TEST_F(Watch, SeesEachEventOnceOverManyBreaks) {
  server_.break_watches_after = 2;
  const Result<v1::Bake> bake = watch(0);
  ASSERT_TRUE(bake.ok()) << bake.error().message;
  EXPECT_THAT(sequences_, ElementsAre(1u, 2u, 3u, 4u, 5u));
  EXPECT_THAT(server_.watch_sequences, ElementsAre(0u, 2u, 4u));
}

TEST_F(Watch, GivesUpOnAServerThatBreaksEveryWatchAfterItsSnapshot) {
  server_.break_watches_at_snapshot = true;
  const Result<v1::Bake> bake = watch(0);
  ASSERT_FALSE(bake.ok());
  EXPECT_EQ(bake.error().code, ErrorCode::kUnavailable);
  EXPECT_GT(server_.watch_sequences.size(), 2u);
}

TEST_F(Watch, LeavesASilentWatchWhenAskedToStop) {
  server_.hold_watches = true;
  std::stop_source stop;
  const Result<v1::Bake> bake = client_->watch(
      "bakes/1", {}, [&](const v1::WatchBakeResponse&) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(bake.ok());
  EXPECT_EQ(bake.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace radbake::api
