#pragma once

#include <cstddef>
#include <functional>

namespace radbake::radiosity {

/// Calls body(begin, end) for disjoint ranges that together are 0..n, on the threads of the current arena.
///
/// Ranges are at least grain / 2 long where n is; how long, in which order and on which thread is by chance, so a
/// result must not depend on it. What was written before the call is seen by every range, and what the ranges wrote is
/// seen after it. Errors: what a body throws is thrown to the caller, after the ranges that were started have ended.
void for_each_range(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace radbake::radiosity
