#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace radbake::jobs {

/// A job that waits for its turn.
struct Waiting {
  std::string name;
  std::string tenant;      ///< turns are shared out between these,
  std::string client;      ///< and of one tenant's between these
  int priority = 0;        ///< higher: earlier, before fairness
  std::int64_t order = 0;  ///< among the jobs of one client: lower is earlier
};

/// Who is next: of the jobs of the highest priority one of the tenant that was served least, of its clients the one
/// that was served least, so that one who submits many does not keep others waiting; of a client's jobs the oldest. A
/// tenant gains nothing by calling itself many clients.
///
/// What somebody was served is counted in usual bakes: seconds of an earlier server, when others were usual, would not
/// compare. One who comes or comes back begins level with the last one served: rest earns no credit.
/// Source: start-time fair queueing, Goyal, Vin & Cheng 1996, with jobs for packets.
class WaitingLine {
 public:
  void push(const Waiting& waiting);
  /// What a client was served by an earlier server: before its first push().
  void remember(const std::string& tenant, const std::string& client, double bakes);
  /// False: it was not in the line.
  bool erase(const std::string& name);
  /// Precondition: not empty. One bake is charged to its client until settle() tells better.
  Waiting pop();
  /// How much of a usual bake one was that pop() gave.
  void settle(const Waiting& popped, double bakes);

  std::size_t size() const { return size_; }
  bool is_empty() const { return size_ == 0; }
  /// The names in the order in which pop() would give them, if no others came.
  std::vector<std::string> order() const;

 private:
  using Client = std::pair<std::string, std::string>;  ///< tenant and client
  /// The jobs of one client and priority, by order.
  using Turn = std::map<std::int64_t, Waiting>;
  /// What those of one kind were served, and what the last one popped had been before.
  template <typename Name>
  struct Accounts {
    std::map<Name, double> served;  ///< usual bakes
    double level = 0;

    void open(const Name& name) { served[name] = std::max(served[name], level); }
    void charge(const Name& name);
  };

  void forget_absent();

  std::map<int, std::map<Client, Turn>, std::greater<>> by_priority_;
  Accounts<std::string> tenants_;
  std::map<std::string, Accounts<std::string>> clients_;  ///< [tenant]
  std::size_t size_ = 0;
};

}  // namespace radbake::jobs
