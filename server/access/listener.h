#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "common/base/result.h"
#include "server/access/listen_address.h"
#include "server/store/file_descriptor.h"

namespace radbake::access {

/// Accepts connections and hands them over, as many at the same time as it is told; one above is closed at once, so
/// that strangers cannot use up the server's descriptors.
///
/// A connection counts until it is shut down, by whichever side: the listener keeps a copy of its descriptor and waits
/// for its end.
class Listener {
 public:
  using OnConnection = std::function<void(store::FileDescriptor)>;

  /// Begins to accept. `on_connection` is called on the listener's thread; it must not throw.
  Listener(Listening listening, std::uint64_t max_connections, OnConnection on_connection);
  /// Stops.
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  const std::string& address() const { return listening_.address; }

  /// Accepts no more and closes the sockets; connections that were handed over go on.
  void stop();

 private:
  void run();
  void accept_from(int listener);
  void forget(int copy);

  Listening listening_;
  const std::uint64_t max_connections_;
  const OnConnection on_connection_;
  store::FileDescriptor events_, wakeup_;
  // Touched by the thread alone.
  std::set<int> copies_;  ///< of the connections that are open
  std::uint64_t num_refused_ = 0;
  std::thread thread_;
};

}  // namespace radbake::access
