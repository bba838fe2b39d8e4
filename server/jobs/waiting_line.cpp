#include "server/jobs/waiting_line.h"

#include <algorithm>

namespace radbake::jobs {

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

Waiting WaitingLine::pop(double expected_seconds) {
  const auto clients = by_priority_.begin();
  // The least served, of equals the one whose job is the oldest.
  const auto turn = std::min_element(clients->second.begin(), clients->second.end(), [&](const auto& a, const auto& b) {
    const double served_a = served_.at(a.first), served_b = served_.at(b.first);
    return served_a != served_b ? served_a < served_b : a.second.begin()->first < b.second.begin()->first;
  });
  const Waiting next = turn->second.begin()->second;
  double& served = served_.at(next.client);
  level_ = std::max(level_, served);
  served += expected_seconds;
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

void WaitingLine::settle(const std::string& client, double expected_seconds, double seconds) {
  if (const auto found = served_.find(client); found != served_.end()) found->second += seconds - expected_seconds;
}

std::vector<std::string> WaitingLine::order(double expected_seconds) const {
  WaitingLine rest = *this;
  std::vector<std::string> names;
  names.reserve(size_);
  while (!rest.is_empty()) names.push_back(rest.pop(expected_seconds).name);
  return names;
}

}  // namespace radbake::jobs
