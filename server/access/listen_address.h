#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/store/file_descriptor.h"

namespace radbake::access {

/// HOST:PORT or unix:PATH, in parts.
struct AddressText {
  std::string host;  ///< without the brackets of [HOST]:PORT; empty for a Unix socket
  std::uint16_t port = 0;
  std::string path;  ///< of a Unix socket, else empty
};

/// Bytes of a Unix socket's path at most.
inline constexpr std::size_t kMaxSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;

/// Reads HOST:PORT ([HOST]:PORT for IPv6, HOST as a number or a name) or unix:PATH; nothing for a text of another form.
std::optional<AddressText> read_address(std::string_view text);

/// Whether only this machine can connect: a Unix socket, localhost, 127.0.0.0/8 or ::1. Nothing for any other name,
/// which has to be resolved.
std::optional<bool> is_local(const AddressText& address);

/// Where a server listens, as the system knows it.
struct ListenAddress {
  struct Socket {
    sockaddr_storage address{};
    socklen_t size = 0;
  };
  std::string text;             ///< as it was given
  std::vector<Socket> sockets;  ///< a name may stand for several
  bool is_local = false;        ///< only this machine can connect: loopback or a Unix socket
};

/// What an address stands for. Errors: kInvalidArgument for what read_address() does not read; kUnavailable for a host
/// that is not known.
Result<ListenAddress> resolve_listen_address(const std::string& text);

/// Sockets that listen.
struct Listening {
  std::vector<store::FileDescriptor> sockets;
  std::string address;  ///< with the port that was chosen where none was given
  std::string path;     ///< of a Unix socket, else empty
};

/// Listens. A Unix socket that a dead server left is replaced; port 0 is any free one, the same on all sockets.
/// Errors: kUnavailable for an address that is not this machine's, or in use.
Result<Listening> listen_on(const ListenAddress& address);

}  // namespace radbake::access
