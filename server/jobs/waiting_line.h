#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace radbake::jobs {

/// A job that waits for its turn.
struct Waiting {
  std::string name;
  std::string client;      ///< whose it is: turns are shared out between these
  int priority = 0;        ///< higher: earlier, before fairness
  std::int64_t order = 0;  ///< among the jobs of one client: lower is earlier
};

/// Who is next: of the jobs of the highest priority that of the client that was served least, so that one who submits
/// many does not keep others waiting; of a client's jobs the oldest.
///
/// What a client was served is counted in usual bakes: seconds of an earlier server, when others were usual, would not
/// compare. One who comes or comes back begins level with the least served of those that wait: rest earns no credit.
/// Source: start-time fair queueing, Goyal, Vin & Cheng 1996, with jobs for packets.
class WaitingLine {
 public:
  void push(const Waiting& waiting);
  /// What a client was served by an earlier server: before its first push().
  void remember(const std::string& client, double bakes) { served_[client] = bakes; }
  /// False: it was not in the line.
  bool erase(const std::string& name);
  /// Precondition: not empty. One bake is charged to its client until settle() tells better.
  Waiting pop();
  /// How much of a usual bake one was that pop() gave.
  void settle(const std::string& client, double bakes);

  std::size_t size() const { return size_; }
  bool is_empty() const { return size_ == 0; }
  /// The names in the order in which pop() would give them, if no others came.
  std::vector<std::string> order() const;

 private:
  /// The jobs of one client and priority, by order.
  using Turn = std::map<std::int64_t, Waiting>;

  std::map<int, std::map<std::string, Turn>, std::greater<>> by_priority_;
  std::map<std::string, double> served_;  ///< [clients that wait or were served] usual bakes
  double level_ = 0;                      ///< what the last one popped had been served
  std::size_t size_ = 0;
};

}  // namespace radbake::jobs
