#include "server/jobs/waiting_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace radbake::jobs {
namespace {

using ::testing::ElementsAre;

TEST(WaitingLine, KeepsTheOrderOfOneClient) {
  WaitingLine line;
  line.push({"second", "", "me", 0, 2});
  line.push({"third", "", "me", 0, 3});
  line.push({"first", "", "me", 0, 1});
  EXPECT_THAT(line.order(), ElementsAre("first", "second", "third"));
  EXPECT_TRUE(line.erase("second"));
  EXPECT_FALSE(line.erase("second"));
  EXPECT_EQ(line.size(), 2u);
  EXPECT_EQ(line.pop().name, "first");
  EXPECT_EQ(line.pop().name, "third");
  EXPECT_TRUE(line.is_empty());
}

TEST(WaitingLine, PutsPriorityBeforeFairness) {
  WaitingLine line;
  line.push({"low", "", "me", -1, 1});
  line.push({"normal", "", "you", 0, 2});
  line.push({"high", "", "me", 5, 3});
  line.push({"high too", "", "me", 5, 4});
  EXPECT_THAT(line.order(), ElementsAre("high", "high too", "normal", "low"));
}

TEST(WaitingLine, TakesTurnsBetweenClients) {
  WaitingLine line;
  for (int i = 0; i < 4; ++i) line.push({"many " + std::to_string(i), "", "many", 0, i});
  line.push({"few 0", "", "few", 0, 10});
  line.push({"few 1", "", "few", 0, 11});
  EXPECT_THAT(line.order(), ElementsAre("many 0", "few 0", "many 1", "few 1", "many 2", "many 3"));
}

TEST(WaitingLine, CountsWhatBakesTookNotJobs) {
  WaitingLine line;
  for (int i = 0; i < 4; ++i) line.push({"short " + std::to_string(i), "", "short", 0, i});
  for (int i = 0; i < 3; ++i) line.push({"long " + std::to_string(i), "", "long", 0, 10 + i});
  std::vector<std::string> names;
  while (!line.is_empty()) {
    const Waiting next = line.pop();
    names.push_back(next.name);
    line.settle(next, next.client == "long" ? 2.5 : 1);
  }
  EXPECT_THAT(names, ElementsAre("short 0", "long 0", "short 1", "short 2", "long 1", "short 3", "long 2"));
}

TEST(WaitingLine, GivesNoCreditForRest) {
  WaitingLine line;
  for (int i = 0; i < 8; ++i) line.push({"busy " + std::to_string(i), "", "busy", 0, i});
  for (int i = 0; i < 5; ++i) line.pop();
  for (int i = 0; i < 3; ++i) line.push({"new " + std::to_string(i), "", "new", 0, 10 + i});
  // Level with the other, not five bakes ahead of it.
  EXPECT_THAT(line.order(), ElementsAre("new 0", "busy 5", "new 1", "busy 6", "new 2", "busy 7"));
}

TEST(WaitingLine, GoesOnWithTheTurnsOfAnEarlierServer) {
  WaitingLine line;
  line.remember("", "served", 2);
  for (int i = 0; i < 3; ++i) line.push({"served " + std::to_string(i), "", "served", 0, i});
  for (int i = 0; i < 3; ++i) line.push({"other " + std::to_string(i), "", "other", 0, 10 + i});
  EXPECT_THAT(line.order(), ElementsAre("other 0", "other 1", "served 0", "other 2", "served 1", "served 2"));
}

TEST(WaitingLine, GivesATenantNoMoreForCallingItselfManyClients) {
  WaitingLine line;
  for (int i = 0; i < 4; ++i) line.push({"many " + std::to_string(i), "greedy", "client " + std::to_string(i), 0, i});
  for (int i = 0; i < 3; ++i) line.push({"few " + std::to_string(i), "plain", "me", 0, 10 + i});
  EXPECT_THAT(line.order(), ElementsAre("many 0", "few 0", "many 1", "few 1", "many 2", "few 2", "many 3"));
}

TEST(WaitingLine, RemembersTheTurnsOfThoseThatWaitHoweverManyComeAndGo) {
  WaitingLine line;
  for (int i = 0; i < 2; ++i) line.push({"busy " + std::to_string(i), "", "busy", 0, i});
  const Waiting popped = line.pop();
  line.settle(popped, 5);
  for (int i = 0; i < 3000; ++i) {
    line.push({"once", "", "client " + std::to_string(i), 0, 10 + i});
    EXPECT_EQ(line.pop().name, "once");
  }
  line.push({"last", "", "other", 0, 9999});
  EXPECT_THAT(line.order(), ElementsAre("last", "busy 1"));
}

TEST(WaitingLine, TellsTheOrderInWhichItWillPop) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    WaitingLine line;
    for (int i = 0; i < 40; ++i) {
      const std::string client(1, static_cast<char>('a' + random() % 6));
      const std::string tenant(1, static_cast<char>('A' + random() % 3));
      line.push({"job " + std::to_string(i), tenant, client, static_cast<int>(random() % 3), i});
      if (random() % 4 == 0) line.settle(line.pop(), 0.5 * static_cast<double>(random() % 5));
    }
    std::vector<std::string> popped;
    const std::vector<std::string> order = line.order();
    while (!line.is_empty()) popped.push_back(line.pop().name);
    EXPECT_EQ(order, popped) << "round " << round;
  }
}

}  // namespace
}  // namespace radbake::jobs
