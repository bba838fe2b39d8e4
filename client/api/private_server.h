#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace radbake::api {

/// A radbaked of one's own: on a Unix socket in a folder that nobody else can enter and that is removed at the end.
///
/// The server runs in a process group of its own, so a Ctrl-C at the terminal reaches the client alone, and ends with
/// the thread that started it (call start() from the main thread).
class PrivateServer {
 public:
  struct Options {
    std::filesystem::path program;  ///< empty: radbaked beside the running executable
    std::filesystem::path costs;    ///< file of what bakes cost on this host, outlives the server; empty: none
    std::chrono::milliseconds start_limit{15000};  ///< until it listens
    std::chrono::milliseconds stop_limit{5000};    ///< from SIGTERM to SIGKILL
  };

  /// Starts the server and waits until it listens.
  ///
  /// Errors: kUnavailable, with the end of what the server wrote, when it does not start.
  static Result<PrivateServer> start(const Options& options);
  /// Stops the server and removes its folder.
  ~PrivateServer();
  PrivateServer(PrivateServer&& other) noexcept;
  PrivateServer& operator=(PrivateServer&&) = delete;

  /// unix:PATH.
  std::string address() const;
  pid_t pid() const { return pid_; }
  /// The last lines of the server's log, for a message about its failure.
  std::string log_tail() const;
  const std::filesystem::path& folder() const { return folder_; }

 private:
  PrivateServer() = default;
  Result<void> launch();
  Result<void> wait_until_listening();
  bool has_exited();
  void stop();

  Options options_;
  std::filesystem::path folder_;  ///< empty after a move
  pid_t pid_ = -1;
  int output_ = -1;  ///< read end of the server's stdout
};

}  // namespace radbake::api
