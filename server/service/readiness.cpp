#include "server/service/readiness.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace radbake::service {

const char* obstacle_name(Obstacle obstacle) {
  switch (obstacle) {
    case Obstacle::kRecovering: return "recovering";
    case Obstacle::kDiskFull: return "disk_full";
    case Obstacle::kStandstill: return "standstill";
    case Obstacle::kDraining: return "draining";
  }
  return "unknown";
}

void Readiness::set(Obstacle obstacle, const std::string& why) {
  const std::lock_guard lock(mutex_);
  const bool was_ready = obstacles_.empty();
  if (!obstacles_.contains(obstacle)) spdlog::warn("not ready ({}): {}", obstacle_name(obstacle), why);
  obstacles_[obstacle] = why;
  tell(was_ready);
}

void Readiness::clear(Obstacle obstacle) {
  const std::lock_guard lock(mutex_);
  const bool was_ready = obstacles_.empty();
  // Every start recovers: nothing to tell.
  const auto level = obstacle == Obstacle::kRecovering ? spdlog::level::debug : spdlog::level::info;
  if (obstacles_.erase(obstacle) > 0) spdlog::log(level, "no longer {}", obstacle_name(obstacle));
  tell(was_ready);
}

void Readiness::tell(bool was_ready) {
  if (listener_ && was_ready != obstacles_.empty()) listener_(obstacles_.empty());
}

bool Readiness::is_ready() const {
  const std::lock_guard lock(mutex_);
  return obstacles_.empty();
}

bool Readiness::has(Obstacle obstacle) const {
  const std::lock_guard lock(mutex_);
  return obstacles_.contains(obstacle);
}

std::string Readiness::why_not() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const auto& [obstacle, why] : obstacles_) text += std::string(obstacle_name(obstacle)) + ": " + why + "\n";
  return text;
}

void Readiness::listen(std::function<void(bool)> listener) {
  const std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
  if (listener_) listener_(obstacles_.empty());
}

}  // namespace radbake::service
