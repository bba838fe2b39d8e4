#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/access/caller.h"
#include "server/service/gate.h"

namespace radbake::service {

/// The long calls of one kind that run at the same time, in all and for each tenant.
class CallSlots : public std::enable_shared_from_this<CallSlots> {
 public:
  /// `limit`: the name of the limit in all; that of a tenant is `limit`_per_tenant.
  static std::shared_ptr<CallSlots> make(std::string limit, std::uint64_t max_calls, std::uint64_t max_per_tenant) {
    return std::shared_ptr<CallSlots>(new CallSlots(std::move(limit), max_calls, max_per_tenant));
  }

  /// A place that one call holds; given back at the end of its life.
  class Slot {
   public:
    Slot() = default;
    Slot(std::shared_ptr<CallSlots> slots, std::string tenant) : slots_(std::move(slots)), tenant_(std::move(tenant)) {}
    ~Slot() { give_back(); }
    Slot(Slot&&) noexcept = default;
    Slot& operator=(Slot&&) = delete;

    /// Before the call is finished: its client may then begin another one.
    void give_back() {
      if (const auto slots = std::move(slots_)) slots->give_back(tenant_);
    }

   private:
    std::shared_ptr<CallSlots> slots_;
    std::string tenant_;
  };

  /// Takes a place for an admitted call; where there is none left the admission becomes RESOURCE_EXHAUSTED, with the
  /// limit's name and when to come again.
  Slot take(Admission& admission);

 private:
  CallSlots(std::string limit, std::uint64_t max_calls, std::uint64_t max_per_tenant)
      : limit_(std::move(limit)), max_calls_(max_calls), max_per_tenant_(max_per_tenant) {}
  void give_back(const std::string& tenant);

  const std::string limit_;
  const std::uint64_t max_calls_, max_per_tenant_;
  std::mutex mutex_;  // guards what follows
  std::uint64_t num_calls_ = 0;
  std::map<std::string, std::uint64_t> num_of_tenant_;  // only tenants with calls
};

}  // namespace radbake::service
