#include "server/jobs/waiting_line.h"

#include <queue>
#include <tuple>

namespace radbake::jobs {
namespace {

/// What the tenant and the client were served, and the client's oldest job: of those of one priority the lowest is
/// next.
using Claim = std::tuple<double, double, std::int64_t>;

}  // namespace

template <typename Name>
void WaitingLine::Accounts<Name>::charge(const Name& name) {
  double& account = served.at(name);
  level = std::max(level, account);
  account += 1;
}

void WaitingLine::push(const Waiting& waiting) {
  tenants_.open(waiting.tenant);
  clients_[waiting.tenant].open(waiting.client);
  by_priority_[waiting.priority][{waiting.tenant, waiting.client}][waiting.order] = waiting;
  ++size_;
}

void WaitingLine::remember(const std::string& tenant, const std::string& client, double bakes) {
  tenants_.served[tenant] += bakes;
  clients_[tenant].served[client] += bakes;
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
  const auto claim_of = [this](const auto& turn) {
    const auto& [tenant, client] = turn.first;
    return Claim(tenants_.served.at(tenant), clients_.at(tenant).served.at(client), turn.second.begin()->first);
  };
  const auto turn = std::min_element(clients->second.begin(), clients->second.end(),
                                     [&](const auto& a, const auto& b) { return claim_of(a) < claim_of(b); });
  const Waiting next = turn->second.begin()->second;
  tenants_.charge(next.tenant);
  clients_.at(next.tenant).charge(next.client);
  turn->second.erase(turn->second.begin());
  if (turn->second.empty()) clients->second.erase(turn);
  if (clients->second.empty()) by_priority_.erase(clients);
  --size_;
  forget_absent();
  return next;
}

void WaitingLine::forget_absent() {
  // Names cost a caller nothing: what is remembered of those that do not wait has a bound.
  constexpr std::size_t kMostRemembered = 1000;
  std::size_t num_accounts = 0;
  for (const auto& [tenant, accounts] : clients_) num_accounts += accounts.served.size();
  if (num_accounts <= size_ + kMostRemembered) return;
  std::map<std::string, Accounts<std::string>> waiting;
  for (const auto& [priority, turns] : by_priority_) {
    for (const auto& [client, turn] : turns) {
      const Accounts<std::string>& known = clients_.at(client.first);
      waiting[client.first].level = known.level;
      waiting[client.first].served[client.second] = known.served.at(client.second);
    }
  }
  clients_ = std::move(waiting);
  std::erase_if(tenants_.served, [this](const auto& entry) { return !clients_.contains(entry.first); });
}

void WaitingLine::settle(const Waiting& popped, double bakes) {
  const auto tenant = tenants_.served.find(popped.tenant);
  if (tenant == tenants_.served.end()) return;
  tenant->second += bakes - 1;
  auto& clients = clients_.at(popped.tenant).served;
  if (const auto client = clients.find(popped.client); client != clients.end()) client->second += bakes - 1;
}

std::vector<std::string> WaitingLine::order() const {
  std::vector<std::string> names;
  names.reserve(size_);
  auto tenants = tenants_.served;
  auto clients = clients_;
  for (const auto& [priority, turns] : by_priority_) {
    struct Candidate {
      Claim claim;
      double *of_tenant, *of_client;
      Turn::const_iterator next, end;

      Claim present_claim() const { return {*of_tenant, *of_client, next->first}; }
      bool operator<(const Candidate& other) const { return claim > other.claim; }  // the top is the lowest
    };
    std::priority_queue<Candidate> candidates;
    const auto put = [&candidates](Candidate candidate) {
      candidate.claim = candidate.present_claim();
      candidates.push(candidate);
    };
    for (const auto& [client, turn] : turns) {
      put({{},
           &tenants.at(client.first),
           &clients.at(client.first).served.at(client.second),
           turn.begin(),
           turn.end()});
    }
    while (!candidates.empty()) {
      Candidate first = candidates.top();
      candidates.pop();
      // Its tenant was served meanwhile: claims only grow.
      if (first.claim != first.present_claim()) {
        put(first);
        continue;
      }
      names.push_back(first.next->second.name);
      *first.of_tenant += 1;
      *first.of_client += 1;
      if (++first.next != first.end) put(first);
    }
  }
  return names;
}

}  // namespace radbake::jobs
