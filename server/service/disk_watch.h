#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/result.h"
#include "server/service/readiness.h"

namespace radbake::service {

/// Free bytes of the disk that a folder lies on, for who is not root.
Result<std::uint64_t> free_disk_bytes(const std::filesystem::path& folder);

struct DiskWatchOptions {
  std::filesystem::path folder;
  std::uint64_t min_free_bytes = 0;  ///< 0: no floor
  std::chrono::milliseconds interval{1000};
  std::function<Result<std::uint64_t>(const std::filesystem::path&)> probe = free_disk_bytes;
  std::function<std::string()> problem;  ///< why no bake starts; empty: they do. May be null
};

/// Looks at the data folder's disk again and again. Below the floor, or when it cannot be looked at, the server is not
/// ready (Obstacle::kDiskFull) and admit() refuses; above it both end by themselves. Nor is it ready while nothing can
/// be recorded or started (Obstacle::kStandstill). Thread-safe.
class DiskWatch {
 public:
  /// Looks once before it returns.
  DiskWatch(DiskWatchOptions options, Readiness& readiness);
  ~DiskWatch();

  /// Whether there is room for something new.
  /// Errors: kResourceExhausted with min_free_disk_bytes, its value and what is free.
  Result<void> admit() const;
  std::uint64_t free_bytes() const { return free_bytes_; }

 private:
  void look();
  void watch(std::stop_token stop);
  std::string shortage() const;

  const DiskWatchOptions options_;
  Readiness& readiness_;
  std::atomic<std::uint64_t> free_bytes_ = 0;
  std::mutex mutex_;
  std::condition_variable_any wakeup_;
  std::jthread thread_;
};

}  // namespace radbake::service
