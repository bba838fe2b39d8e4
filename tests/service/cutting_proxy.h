#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace radbake::testing {

/// Carries connections to a server, and cuts them all, without a word to either side, whenever so many bytes have gone
/// up since the last cut.
class CuttingProxy {
 public:
  /// Listens on a Unix socket in `folder` and connects to that of a server. `cuts`: bytes between them; then none.
  /// `delay`: until the first byte of a connection is carried.
  CuttingProxy(const std::filesystem::path& folder, const std::string& server_socket, std::vector<std::uint64_t> cuts,
               std::chrono::milliseconds delay = {});
  ~CuttingProxy();

  std::string address() const { return "unix:" + socket_; }
  std::size_t num_cuts() const { return num_cuts_; }

 private:
  void accept_connections();
  void carry(int client, int server);
  bool is_due(std::uint64_t bytes_up);
  void cut_all();

  std::string socket_, server_socket_;
  std::vector<std::uint64_t> cuts_;
  const std::chrono::milliseconds delay_;
  std::atomic<std::size_t> num_cuts_ = 0;
  std::atomic<std::uint64_t> since_cut_ = 0;
  int listener_ = -1;
  std::mutex mutex_;  // guards what follows
  std::set<int> open_;
  std::vector<std::thread> threads_;
  std::thread acceptor_;
};

}  // namespace radbake::testing
