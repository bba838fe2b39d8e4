#include "server/access/listen_address.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <string_view>

namespace radbake::access {
namespace {

constexpr std::string_view kUnixScheme = "unix:";
constexpr int kMaxWaiting = 512;

bool is_loopback(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) {
    return ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24 == IN_LOOPBACKNET;
  }
  return address.ss_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr) != 0;
}

Result<ListenAddress> resolve_path(const std::string& text) {
  const std::string path = text.substr(kUnixScheme.size());
  ListenAddress address{text, std::vector<ListenAddress::Socket>(1), true};
  auto& to = reinterpret_cast<sockaddr_un&>(address.sockets.front().address);
  if (path.empty() || path.size() >= sizeof to.sun_path) {
    return invalid_argument("--listen " + text + ": the path must have 1 to " + std::to_string(sizeof to.sun_path - 1) +
                            " bytes, not " + std::to_string(path.size()));
  }
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, path.c_str(), path.size() + 1);
  address.sockets.front().size = sizeof to;
  return address;
}

const sockaddr* to_system(const ListenAddress::Socket& socket) {
  return reinterpret_cast<const sockaddr*>(&socket.address);
}

in_port_t& port_of(sockaddr_storage& address) {
  return address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address).sin6_port
                                       : reinterpret_cast<sockaddr_in&>(address).sin_port;
}

/// The machine has no such address, whoever uses it.
bool is_not_here(int problem) { return problem == EAFNOSUPPORT || problem == EADDRNOTAVAIL; }

/// Removes the socket of a server that has gone. One that answers stays, and bind() then says that it is in use.
void remove_dead_socket(const ListenAddress::Socket& socket) {
  const char* path = reinterpret_cast<const sockaddr_un&>(socket.address).sun_path;
  struct stat info {};
  if (::lstat(path, &info) != 0 || !S_ISSOCK(info.st_mode)) return;
  const store::FileDescriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (::connect(probe.get(), to_system(socket), socket.size) != 0 && errno == ECONNREFUSED) ::unlink(path);
}

/// The system's number for what went wrong; 0 for a socket that listens.
int try_listening(const ListenAddress::Socket& socket, store::FileDescriptor& listener) {
  const int family = socket.address.ss_family;
  if (family == AF_UNIX) remove_dead_socket(socket);
  listener = store::FileDescriptor(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener.is_open()) return errno;
  const int on = 1, off = 0;
  // A port whose last server has just ended; never one with a living server.
  if (family != AF_UNIX) ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  // [::] is IPv4's addresses too.
  if (family == AF_INET6) ::setsockopt(listener.get(), IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
  if (::bind(listener.get(), to_system(socket), socket.size) != 0) return errno;
  return ::listen(listener.get(), kMaxWaiting) != 0 ? errno : 0;
}

}  // namespace

Result<ListenAddress> resolve_listen_address(const std::string& text) {
  if (text.starts_with(kUnixScheme)) return resolve_path(text);
  const auto wrong = [&] {
    return invalid_argument("--listen '" + text + "': expected HOST:PORT with a port of 0 to 65535, or unix:PATH");
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return wrong();
  std::string host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string::npos) {
    return wrong();
  }
  const std::string port = text.substr(colon + 1);
  std::uint16_t number = 0;
  const auto [end, problem] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (problem != std::errc() || end != port.data() + port.size()) return wrong();

  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int failure = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); failure != 0) {
    return Error{ErrorCode::kUnavailable, "--listen '" + text + "': " + ::gai_strerror(failure)};
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, &::freeaddrinfo);
  ListenAddress address{text, {}, true};
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    ListenAddress::Socket& socket = address.sockets.emplace_back();
    std::memcpy(&socket.address, one->ai_addr, one->ai_addrlen);
    socket.size = one->ai_addrlen;
    address.is_local = address.is_local && is_loopback(socket.address);
  }
  return address;
}

Result<Listening> listen_on(const ListenAddress& address) {
  Listening listening;
  listening.address = address.text;
  if (address.sockets.front().address.ss_family == AF_UNIX) {
    listening.path = address.text.substr(kUnixScheme.size());
  }
  in_port_t port = 0;
  int problem = 0;
  for (ListenAddress::Socket socket : address.sockets) {
    const bool is_unix = socket.address.ss_family == AF_UNIX;
    if (port != 0) port_of(socket.address) = port;
    store::FileDescriptor listener;
    problem = try_listening(socket, listener);
    // A name may stand for an IPv6 address where IPv6 is off: its other addresses do.
    if (is_not_here(problem)) continue;
    if (problem != 0) break;
    if (!is_unix) {
      ::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&socket.address), &socket.size);
      port = port_of(socket.address);
    }
    listening.sockets.push_back(std::move(listener));
  }
  if (listening.sockets.empty() || (problem != 0 && !is_not_here(problem))) {
    return Error{
        ErrorCode::kUnavailable,
        "cannot listen on '" + address.text +
            "': not an address of this machine (host:port or unix:PATH), or in use: " + std::strerror(problem)};
  }
  if (port != 0) {
    listening.address = address.text.substr(0, address.text.rfind(':')) + ":" + std::to_string(ntohs(port));
  }
  return listening;
}

}  // namespace radbake::access
