#include "server/access/listener.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

#include "common/base/check.h"

namespace radbake::access {
namespace {

/// Where accept() fails for want of descriptors or memory: until it is tried again.
constexpr std::chrono::milliseconds kPause{100};
/// Connections that are refused are logged one by one up to this number, then each time that it doubles.
constexpr std::uint64_t kNumLogged = 4;

void watch(int events, int fd, std::uint32_t what) {
  epoll_event event{};
  event.events = what;
  event.data.fd = fd;
  RADBAKE_CHECK_EQ(::epoll_ctl(events, EPOLL_CTL_ADD, fd, &event), 0);
}

bool is_power_of_two(std::uint64_t n) { return (n & (n - 1)) == 0; }

}  // namespace

Listener::Listener(Listening listening, std::uint64_t max_connections, OnConnection on_connection)
    : listening_(std::move(listening)),
      max_connections_(max_connections),
      on_connection_(std::move(on_connection)),
      events_(::epoll_create1(EPOLL_CLOEXEC)),
      wakeup_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  watch(events_.get(), wakeup_.get(), EPOLLIN);
  for (const auto& socket : listening_.sockets) watch(events_.get(), socket.get(), EPOLLIN);
  thread_ = std::thread([this] { run(); });
}

Listener::~Listener() {
  stop();
  for (const int copy : copies_) ::close(copy);
}

void Listener::stop() {
  if (!thread_.joinable()) return;
  ::eventfd_write(wakeup_.get(), 1);
  thread_.join();
  listening_.sockets.clear();
  if (!listening_.path.empty()) ::unlink(listening_.path.c_str());
}

void Listener::run() {
  std::array<epoll_event, 64> events{};
  while (true) {
    const int num_events = ::epoll_wait(events_.get(), events.data(), static_cast<int>(events.size()), -1);
    // What has ended makes room for what has come.
    for (int i = 0; i < num_events; ++i) {
      if (copies_.contains(events[i].data.fd)) forget(events[i].data.fd);
    }
    for (int i = 0; i < num_events; ++i) {
      const int fd = events[i].data.fd;
      if (fd == wakeup_.get()) return;
      const bool is_listener =
          std::any_of(listening_.sockets.begin(), listening_.sockets.end(), [&](auto& s) { return s.get() == fd; });
      if (is_listener) accept_from(fd);
    }
  }
}

void Listener::accept_from(int listener) {
  store::FileDescriptor connection(::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!connection.is_open()) {
    const bool is_short_of = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
    if (is_short_of) std::this_thread::sleep_for(kPause);
    return;
  }
  if (copies_.size() >= max_connections_) {
    ++num_refused_;
    if (num_refused_ <= kNumLogged || is_power_of_two(num_refused_)) {
      spdlog::warn("a connection was refused: max_connections is {} ({} refused so far)", max_connections_,
                   num_refused_);
    }
    return;
  }
  const int copy = ::fcntl(connection.get(), F_DUPFD_CLOEXEC, 0);
  if (copy < 0) return;
  copies_.insert(copy);
  // Both directions shut: EPOLLHUP, which comes unasked.
  watch(events_.get(), copy, 0);
  const int on = 1;
  ::setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // a Unix socket knows no such thing
  on_connection_(std::move(connection));
}

void Listener::forget(int copy) {
  copies_.erase(copy);
  // Closing does not end the watch while the connection's own descriptor is open.
  ::epoll_ctl(events_.get(), EPOLL_CTL_DEL, copy, nullptr);
  ::close(copy);
}

}  // namespace radbake::access
