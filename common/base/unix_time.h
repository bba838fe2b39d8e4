#pragma once

#include <chrono>
#include <cstdint>

namespace radbake {

/// Milliseconds since 1970, by the system's clock.
inline std::int64_t unix_ms_now() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace radbake
