#include "server/service/disk_watch.h"

#include <spdlog/spdlog.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "server/service/config_values.h"

namespace radbake::service {
Result<std::uint64_t> free_disk_bytes(const std::filesystem::path& folder) {
  struct statvfs facts {};
  if (::statvfs(folder.c_str(), &facts) != 0) {
    return internal_error("cannot look at the disk of " + folder.string() + ": " +
                          std::generic_category().message(errno));
  }
  return static_cast<std::uint64_t>(facts.f_bavail) * facts.f_frsize;
}

DiskWatch::DiskWatch(DiskWatchOptions options, Readiness& readiness)
    : options_(std::move(options)), readiness_(readiness) {
  look();
  thread_ = std::jthread([this](std::stop_token stop) { watch(stop); });
}

DiskWatch::~DiskWatch() {
  thread_.request_stop();
  thread_.join();
}

std::string DiskWatch::shortage() const {
  return write_bytes(free_bytes_) + " bytes are free on the disk of " + options_.folder.string() +
         ", min_free_disk_bytes is " + write_bytes(options_.min_free_bytes);
}

Result<void> DiskWatch::admit() const {
  if (free_bytes_ >= options_.min_free_bytes) return {};
  return Error{ErrorCode::kResourceExhausted, shortage()};
}

void DiskWatch::look() {
  const auto free = options_.probe(options_.folder);
  if (!free.ok()) spdlog::error("{}", free.error().message);
  free_bytes_ = free.ok() ? *free : 0;
  if (free_bytes_ < options_.min_free_bytes) {
    readiness_.set(Obstacle::kDiskFull, free.ok() ? shortage() : free.error().message);
  } else {
    readiness_.clear(Obstacle::kDiskFull);
  }
  const std::string problem = options_.problem ? options_.problem() : "";
  if (problem.empty()) {
    readiness_.clear(Obstacle::kStandstill);
  } else {
    readiness_.set(Obstacle::kStandstill, problem);
  }
}

void DiskWatch::watch(std::stop_token stop) {
  while (!stop.stop_requested()) {
    std::unique_lock lock(mutex_);
    wakeup_.wait_for(lock, stop, options_.interval, [] { return false; });
    lock.unlock();
    if (!stop.stop_requested()) look();
  }
}

}  // namespace radbake::service
