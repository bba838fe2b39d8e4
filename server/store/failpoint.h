#pragma once

#include <atomic>

namespace radbake::store {

// Where a test may end or disturb the server. Null, and nothing happens, in any program that does not set them.

/// Called before and after what must survive goes to the disk, a worker starts, a result is published.
inline std::atomic<void (*)(const char* name)> failpoint_hook = nullptr;
/// The error that an operation on the disk meets, as errno; 0: none.
inline std::atomic<int (*)(const char* operation)> fault_hook = nullptr;

inline void failpoint(const char* name) {
  if (const auto hook = failpoint_hook.load()) hook(name);
}
inline int fault(const char* operation) {
  const auto hook = fault_hook.load();
  return hook ? hook(operation) : 0;
}

}  // namespace radbake::store
