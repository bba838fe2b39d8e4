#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace radbake::handover {

/// What a worker that was started ahead of need is told when there is work: who it is now, and its inputs.
struct Assignment {
  std::string job;
  std::uint32_t attempt = 0;
  std::vector<int> inputs;  ///< open descriptors, in the order of radbake.v1.StartWork.inputs
};

/// The kernel passes 253 descriptors at a time; a job with more gets a worker of its own from the start.
inline constexpr std::size_t kMaxInputs = 200;
inline constexpr std::size_t kMaxJobBytes = 100;
/// Whether one message holds it.
bool fits(const Assignment& assignment);

/// What a worker says once it waits. Errors: kUnavailable when nobody is there.
Result<void> announce(int socket);

/// Whether the worker at the other end waits, or does so before the time is up: false at once where it is gone. Takes
/// what it said off the socket; ask once.
bool is_announced(int socket, std::chrono::milliseconds limit);

/// Sends an assignment over a connected Unix socket, before anything else; the descriptors stay open here.
/// Precondition: fits(). Errors: kUnavailable when nobody is there.
Result<void> give(int socket, const Assignment& assignment);

/// Waits for an assignment and takes it off the socket, byte for byte: what follows on it is gRPC's. The descriptors
/// have new numbers here, and close on exec.
/// Errors: kUnavailable when the other end was closed; kInternal for anything else than an assignment.
Result<Assignment> take(int socket);

}  // namespace radbake::handover
