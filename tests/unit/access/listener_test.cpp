#include "server/access/listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <vector>

#include "tests/service/temporary_folder.h"

namespace radbake::access {
namespace {

using store::FileDescriptor;

/// No wait of a test is longer: a failure then, where it would hang.
constexpr int kWaitLimitMs = 30'000;

Listening listen(const std::string& text) {
  auto address = resolve_listen_address(text);
  EXPECT_TRUE(address.ok());
  auto listening = listen_on(*address);
  EXPECT_TRUE(listening.ok()) << listening.error().message;
  return std::move(listening).value();
}

FileDescriptor connect_to(const std::string& text) {
  const auto address = resolve_listen_address(text);
  EXPECT_TRUE(address.ok());
  const auto& to = address->sockets.front();
  FileDescriptor socket(::socket(to.address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to.address), to.size), 0);
  return socket;
}

/// The other side has closed.
bool is_closed(const FileDescriptor& socket) {
  pollfd wait{socket.get(), POLLIN, 0};
  char byte = 0;
  return ::poll(&wait, 1, kWaitLimitMs) == 1 && ::recv(socket.get(), &byte, 1, 0) <= 0;
}

/// Keeps what a listener hands over.
class Connections {
 public:
  Listener::OnConnection keep() {
    return [this](FileDescriptor connection) {
      const std::lock_guard lock(mutex_);
      connections_.push_back(std::move(connection));
      changed_.notify_all();
    };
  }
  bool wait_for(std::size_t number) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::milliseconds(kWaitLimitMs),
                             [&] { return connections_.size() >= number; });
  }
  /// Ends one as a server does: shut down, then closed.
  void end(std::size_t index) {
    const std::lock_guard lock(mutex_);
    ::shutdown(connections_[index].get(), SHUT_RDWR);
    connections_[index].reset();
  }
  std::size_t size() {
    const std::lock_guard lock(mutex_);
    return connections_.size();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<FileDescriptor> connections_;
};

class ListenerTest : public ::testing::TestWithParam<const char*> {
 protected:
  std::string address() const {
    return GetParam() == std::string("unix") ? "unix:" + (folder_.path() / "socket").string() : GetParam();
  }

  radbake::testing::TemporaryFolder folder_;
  Connections connections_;
};

TEST_P(ListenerTest, ClosesAConnectionAboveTheLimit) {
  Listener listener(listen(address()), 2, connections_.keep());
  const FileDescriptor first = connect_to(listener.address()), second = connect_to(listener.address());
  ASSERT_TRUE(connections_.wait_for(2));
  EXPECT_TRUE(is_closed(connect_to(listener.address())));
  EXPECT_EQ(connections_.size(), 2u);
}

TEST_P(ListenerTest, HasAPlaceAgainWhenTheServerEndsAConnection) {
  Listener listener(listen(address()), 1, connections_.keep());
  const FileDescriptor first = connect_to(listener.address());
  ASSERT_TRUE(connections_.wait_for(1));
  EXPECT_TRUE(is_closed(connect_to(listener.address())));
  connections_.end(0);
  // The client sees the end although the listener had a copy of the connection.
  EXPECT_TRUE(is_closed(first));
  const FileDescriptor next = connect_to(listener.address());
  EXPECT_TRUE(connections_.wait_for(2));
}

TEST_P(ListenerTest, RefusesNewConnectionsAndKeepsOldOnesWhenItStops) {
  Listener listener(listen(address()), 4, connections_.keep());
  const std::string where = listener.address();
  const FileDescriptor first = connect_to(where);
  ASSERT_TRUE(connections_.wait_for(1));
  listener.stop();
  const auto again = resolve_listen_address(where);
  const auto& to = again->sockets.front();
  const FileDescriptor socket(::socket(to.address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_NE(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to.address), to.size), 0);
  pollfd wait{first.get(), POLLIN, 0};
  EXPECT_EQ(::poll(&wait, 1, 0), 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ListenerTest, ::testing::Values("127.0.0.1:0", "unix"),
                         [](const auto& kind) { return kind.index == 0 ? "Tcp" : "Unix"; });

TEST(Listening, SaysThePortThatWasChosen) {
  const Listening listening = listen("127.0.0.1:0");
  EXPECT_THAT(listening.address, ::testing::MatchesRegex("127.0.0.1:[1-9][0-9]*"));
}

TEST(Listening, RefusesAnAddressInUse) {
  const Listening tcp = listen("127.0.0.1:0");
  const auto again = listen_on(*resolve_listen_address(tcp.address));
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(again.error().message, ::testing::HasSubstr(tcp.address));
  EXPECT_FALSE(listen_on(*resolve_listen_address("192.0.2.1:0")).ok());
}

TEST(Listening, TakesASocketOverFromADeadServerOnly) {
  const radbake::testing::TemporaryFolder folder;
  const std::string text = "unix:" + (folder.path() / "socket").string();
  const auto address = resolve_listen_address(text);
  {
    const Listening living = listen(text);
    EXPECT_FALSE(listen_on(*address).ok());
  }
  // Its file is still there: nobody removed it.
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "socket"));
  EXPECT_TRUE(listen_on(*address).ok());
}

}  // namespace
}  // namespace radbake::access
