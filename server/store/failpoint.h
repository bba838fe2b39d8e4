#pragma once

namespace radbake::store {

// Where a test may end or disturb the server. Null, and nothing happens, in any program that does not set them.

/// Called before and after what must survive goes to the disk, a worker starts, a result is published.
inline void (*failpoint_hook)(const char* name) = nullptr;
/// The error that an operation on the disk meets, as errno; 0: none.
inline int (*fault_hook)(const char* operation) = nullptr;

inline void failpoint(const char* name) {
  if (failpoint_hook != nullptr) failpoint_hook(name);
}
inline int fault(const char* operation) { return fault_hook != nullptr ? fault_hook(operation) : 0; }

}  // namespace radbake::store
