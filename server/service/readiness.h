#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace radbake::service {

/// What keeps a server from taking work.
enum class Obstacle { kRecovering, kDiskFull, kStandstill, kDraining };
inline constexpr Obstacle kObstacles[] = {Obstacle::kRecovering, Obstacle::kDiskFull, Obstacle::kStandstill,
                                          Obstacle::kDraining};
/// "recovering", "disk_full", "standstill", "draining".
const char* obstacle_name(Obstacle obstacle);

/// Whether the server takes work, and if not, why. It does when nothing stands in its way; it begins as recovering.
/// Thread-safe.
class Readiness {
 public:
  /// why: for people, with the value: "120M are free, min_free_disk_bytes is 256M".
  void set(Obstacle obstacle, const std::string& why);
  void clear(Obstacle obstacle);

  bool is_ready() const;
  bool has(Obstacle obstacle) const;
  /// One line for each obstacle; empty when ready.
  std::string why_not() const;

  /// Calls `listener` now and whenever the answer changes, one call at a time and in order. It must be quick and must
  /// not call this object. A null listener ends that.
  void listen(std::function<void(bool is_ready)> listener);

 private:
  void tell(bool was_ready);

  mutable std::mutex mutex_;  // guards what follows
  std::map<Obstacle, std::string> obstacles_ = {{Obstacle::kRecovering, "taking up what an earlier server left"}};
  std::function<void(bool)> listener_;
};

}  // namespace radbake::service
