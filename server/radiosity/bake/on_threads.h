#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <optional>
#include <thread>
#include <type_traits>

namespace radbake::radiosity {

/// Runs `body` in an arena of so many threads (0: all cores), and returns what it returns. More threads than cores are
/// allowed: results do not depend on the number.
template <typename Body>
std::invoke_result_t<Body> on_threads(int threads, const Body& body) {
  if (threads <= 0) threads = static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  std::optional<std::invoke_result_t<Body>> result;
  arena.execute([&] { result.emplace(body()); });
  return std::move(*result);
}

}  // namespace radbake::radiosity
