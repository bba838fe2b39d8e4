#pragma once

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace radbake::access {

/// How often files are looked at, at most.
inline constexpr std::chrono::milliseconds kReloadInterval{1000};

/// A value that was read from files, and is read again when one of them changes: another file under its name, another
/// size or time. The files are looked at when the value is asked for, at most once an interval. Files that cannot be
/// read leave the value as it was and are logged, once for each change. Thread-safe.
template <typename T>
class Reloaded {
 public:
  using Files = std::vector<std::filesystem::path>;
  using Read = std::function<Result<T>()>;

  /// `read` reads all the files. Errors: those of the first read.
  static Result<std::unique_ptr<Reloaded>> open(Files files, Read read,
                                                std::chrono::milliseconds interval = kReloadInterval) {
    std::unique_ptr<Reloaded> reloaded(new Reloaded(std::move(files), std::move(read), interval));
    RADBAKE_ASSIGN_OR_RETURN(T value, reloaded->read_());
    reloaded->value_ = std::make_shared<const T>(std::move(value));
    return reloaded;
  }

  /// The value of now; the same object while nothing has changed.
  std::shared_ptr<const T> current() {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - last_look_ < interval_) return value_;
    last_look_ = now;
    // The stamps are older than what is read: a change in between shows the next time.
    if (auto stamps = stamps_of(files_); stamps != stamps_) {
      stamps_ = std::move(stamps);
      if (auto value = read_(); value.ok()) {
        value_ = std::make_shared<const T>(std::move(value).value());
        spdlog::info("{} has changed: read again", files_.front().string());
      } else {
        spdlog::error("{}: what was read before stays in force", value.error().message);
      }
    }
    return value_;
  }

 private:
  /// Device, inode, size and time of a file; zeros where there is none.
  using Stamp = std::array<std::uint64_t, 5>;

  Reloaded(Files files, Read read, std::chrono::milliseconds interval)
      : files_(std::move(files)), read_(std::move(read)), interval_(interval), stamps_(stamps_of(files_)) {}

  static std::vector<Stamp> stamps_of(const Files& files) {
    std::vector<Stamp> stamps;
    for (const auto& file : files) {
      struct stat info {};
      if (::stat(file.c_str(), &info) != 0) info = {};
      stamps.push_back({info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size),
                        static_cast<std::uint64_t>(info.st_mtim.tv_sec),
                        static_cast<std::uint64_t>(info.st_mtim.tv_nsec)});
    }
    return stamps;
  }

  const Files files_;
  const Read read_;
  const std::chrono::milliseconds interval_;
  std::mutex mutex_;  // guards what follows
  std::vector<Stamp> stamps_;
  std::chrono::steady_clock::time_point last_look_ = std::chrono::steady_clock::now();
  std::shared_ptr<const T> value_;
};

}  // namespace radbake::access
