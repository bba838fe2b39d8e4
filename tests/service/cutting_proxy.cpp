#include "tests/service/cutting_proxy.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <utility>

#include "common/base/check.h"

namespace radbake::testing {
namespace {

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  RADBAKE_CHECK(path.size() < sizeof address.sun_path);
  std::strcpy(address.sun_path, path.c_str());
  return address;
}

int connect_to(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_un address = address_of(path);
  RADBAKE_CHECK_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

}  // namespace

CuttingProxy::CuttingProxy(const std::filesystem::path& folder, const std::string& server_socket,
                           std::vector<std::uint64_t> cuts, std::chrono::milliseconds delay)
    : socket_(folder / "proxy"), server_socket_(server_socket), cuts_(std::move(cuts)), delay_(delay) {
  listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_un address = address_of(socket_);
  RADBAKE_CHECK_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  RADBAKE_CHECK_EQ(::listen(listener_, 16), 0);
  acceptor_ = std::thread([this] { accept_connections(); });
}

CuttingProxy::~CuttingProxy() {
  ::shutdown(listener_, SHUT_RDWR);
  acceptor_.join();
  cut_all();
  for (std::thread& thread : threads_) thread.join();
  ::close(listener_);
}

void CuttingProxy::accept_connections() {
  while (true) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) return;
    const int server = connect_to(server_socket_);
    const std::lock_guard lock(mutex_);
    open_.insert({client, server});
    threads_.emplace_back([this, client, server] { carry(client, server); });
  }
}

void CuttingProxy::carry(int client, int server) {
  char buffer[16 << 10];
  std::this_thread::sleep_for(delay_);
  while (true) {
    pollfd ends[] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    if (::poll(ends, 2, -1) < 0) break;
    bool is_open = true;
    for (int side = 0; side < 2 && is_open; ++side) {
      if (ends[side].revents == 0) continue;
      const ssize_t count = ::read(ends[side].fd, buffer, sizeof buffer);
      is_open = count > 0;
      for (ssize_t sent = 0; is_open && sent < count;) {
        const ssize_t part =
            ::send(side == 0 ? server : client, buffer + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
        is_open = part > 0;
        sent += part;
      }
      if (is_open && side == 0 && is_due(static_cast<std::uint64_t>(count))) cut_all();
    }
    if (!is_open) break;
  }
  const std::lock_guard lock(mutex_);
  for (const int fd : {client, server}) {
    open_.erase(fd);
    ::close(fd);
  }
}

bool CuttingProxy::is_due(std::uint64_t bytes_up) {
  const std::size_t next = num_cuts_;
  since_cut_ += bytes_up;
  if (next >= cuts_.size() || since_cut_ < cuts_[next]) return false;
  since_cut_ = 0;
  num_cuts_ = next + 1;
  return true;
}

void CuttingProxy::cut_all() {
  const std::lock_guard lock(mutex_);
  for (const int fd : open_) ::shutdown(fd, SHUT_RDWR);
}

}  // namespace radbake::testing
