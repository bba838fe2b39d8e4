#include "server/jobs/waiting_line.h"

#include <algorithm>
#include <queue>
#include <utility>

namespace radbake::jobs {
namespace {

/// A client by what it was served and by its oldest job, of those that have the same priority: the lowest is next.
using Claim = std::pair<double, std::int64_t>;

}  // namespace

void WaitingLine::push(const Waiting& waiting) {
  double& served = served_[waiting.client];
  served = std::max(served, level_);
  by_priority_[waiting.priority][waiting.client][waiting.order] = waiting;
  ++size_;
}

bool WaitingLine::erase(const std::string& name) {
  for (auto clients = by_priority_.begin(); clients != by_priority_.end(); ++clients) {
    for (auto turn = clients->second.begin(); turn != clients->second.end(); ++turn) {
      const auto found = std::find_if(turn->second.begin(), turn->second.end(),
                                      [&](const auto& entry) { return entry.second.name == name; });
      if (found == turn->second.end()) continue;
      turn->second.erase(found);
      if (turn->second.empty()) clients->second.erase(turn);
      if (clients->second.empty()) by_priority_.erase(clients);
      --size_;
      return true;
    }
  }
  return false;
}

Waiting WaitingLine::pop() {
  const auto clients = by_priority_.begin();
  const auto claim_of = [this](const auto& turn) { return Claim(served_.at(turn.first), turn.second.begin()->first); };
  const auto turn = std::min_element(clients->second.begin(), clients->second.end(),
                                     [&](const auto& a, const auto& b) { return claim_of(a) < claim_of(b); });
  const Waiting next = turn->second.begin()->second;
  double& served = served_.at(next.client);
  level_ = std::max(level_, served);
  served += 1;
  turn->second.erase(turn->second.begin());
  if (turn->second.empty()) clients->second.erase(turn);
  if (clients->second.empty()) by_priority_.erase(clients);
  --size_;
  // Who is behind the level has no claim that is worth keeping.
  std::erase_if(served_, [&](const auto& entry) {
    return entry.second <= level_ && std::none_of(by_priority_.begin(), by_priority_.end(), [&](const auto& waiting) {
             return waiting.second.contains(entry.first);
           });
  });
  return next;
}

void WaitingLine::settle(const std::string& client, double bakes) {
  if (const auto found = served_.find(client); found != served_.end()) found->second += bakes - 1;
}

std::vector<std::string> WaitingLine::order() const {
  std::vector<std::string> names;
  names.reserve(size_);
  std::map<std::string, double> served = served_;
  for (const auto& [priority, turns] : by_priority_) {
    struct Candidate {
      Claim claim;
      double* served;
      Turn::const_iterator next, end;
      bool operator<(const Candidate& other) const { return claim > other.claim; }  // the top is the lowest
    };
    std::priority_queue<Candidate> candidates;
    for (const auto& [client, turn] : turns) {
      double& of_client = served.at(client);
      candidates.push({{of_client, turn.begin()->first}, &of_client, turn.begin(), turn.end()});
    }
    while (!candidates.empty()) {
      Candidate first = candidates.top();
      candidates.pop();
      names.push_back(first.next->second.name);
      *first.served += 1;
      if (++first.next == first.end) continue;
      first.claim = {*first.served, first.next->first};
      candidates.push(first);
    }
  }
  return names;
}

}  // namespace radbake::jobs
