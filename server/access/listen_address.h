#pragma once

#include <sys/socket.h>

#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/store/file_descriptor.h"

namespace radbake::access {

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

/// Reads HOST:PORT ([HOST]:PORT for IPv6, HOST as a number or a name) or unix:PATH.
/// Errors: kInvalidArgument for a text of another form; kUnavailable for a host that is not known.
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
