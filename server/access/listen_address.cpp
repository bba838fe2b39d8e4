#include "server/access/listen_address.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

namespace radbake::access {
namespace {

constexpr std::string_view kUnixScheme = "unix:";
constexpr int kMaxWaiting = 512;

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    return ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24 == IN_LOOPBACKNET;
  }
  return address.sa_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr) != 0;
}

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// flags: AI_NUMERICHOST to ask nobody. Returns what getaddrinfo() does.
int find_addresses(const AddressText& text, int flags, Addresses& addresses) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV | flags;
  addrinfo* found = nullptr;
  const int failure = ::getaddrinfo(text.host.c_str(), std::to_string(text.port).c_str(), &hints, &found);
  addresses.reset(found);
  return failure;
}

ListenAddress address_of_path(const std::string& text, const std::string& path) {
  ListenAddress address{text, std::vector<ListenAddress::Socket>(1), true};
  auto& to = reinterpret_cast<sockaddr_un&>(address.sockets.front().address);
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

std::optional<AddressText> read_address(std::string_view text) {
  AddressText address;
  if (text.starts_with(kUnixScheme)) {
    address.path = text.substr(kUnixScheme.size());
    if (address.path.empty() || address.path.size() > kMaxSocketPathBytes) return std::nullopt;
    return address;
  }
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return std::nullopt;
  std::string_view host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find_first_of(":[] /") != std::string_view::npos) {
    return std::nullopt;
  }
  address.host = host;
  const std::string_view port = text.substr(colon + 1);
  const auto [end, problem] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (problem != std::errc() || end != port.data() + port.size()) return std::nullopt;
  return address;
}

std::optional<bool> is_local(const AddressText& address) {
  if (!address.path.empty() || address.host == "localhost") return true;
  Addresses found(nullptr, &::freeaddrinfo);
  if (find_addresses(address, AI_NUMERICHOST, found) != 0) return std::nullopt;
  return is_loopback(*found->ai_addr);
}

Result<ListenAddress> resolve_listen_address(const std::string& text) {
  const auto parts = read_address(text);
  if (!parts) {
    return invalid_argument("--listen '" + text +
                            "': expected HOST:PORT with a port of 0 to 65535, or unix:PATH with " +
                            "a path of at most " + std::to_string(kMaxSocketPathBytes) + " bytes");
  }
  if (!parts->path.empty()) return address_of_path(text, parts->path);
  Addresses addresses(nullptr, &::freeaddrinfo);
  if (const int failure = find_addresses(*parts, 0, addresses); failure != 0) {
    return Error{ErrorCode::kUnavailable, "--listen '" + text + "': " + ::gai_strerror(failure)};
  }
  ListenAddress address{text, {}, true};
  for (const addrinfo* one = addresses.get(); one != nullptr; one = one->ai_next) {
    ListenAddress::Socket& socket = address.sockets.emplace_back();
    std::memcpy(&socket.address, one->ai_addr, one->ai_addrlen);
    socket.size = one->ai_addrlen;
    address.is_local = address.is_local && is_loopback(*one->ai_addr);
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
