#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace radbake::store {

/// A few threads that run tasks in the order in which they were posted; with one thread, one after the other.
/// The destructor runs what is still waiting.
class TaskPool {
 public:
  explicit TaskPool(int num_threads);
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  /// Runs a task some time later. Tasks do not throw.
  void post(std::function<void()> task);

  /// Runs a task and waits for its value. Never call it from a task of a pool with one thread.
  template <typename Task>
  auto run(Task task) {
    const auto packaged = std::make_shared<std::packaged_task<std::invoke_result_t<Task>()>>(std::move(task));
    auto value = packaged->get_future();
    post([packaged] { (*packaged)(); });
    return value.get();
  }

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace radbake::store
