#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "server/service/call_slots.h"
#include "server/service/gate.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// Calls of one request and one answer. They wait for the pool only once it is known who makes them, and as many as
/// there is room for: neither strangers nor one tenant can put their calls before everybody's.
class UnaryCalls {
 public:
  UnaryCalls(const Gate& gate, store::TaskPool& pool)
      : gate_(gate), pool_(pool), waiting_(CallSlots::make("max_waiting_calls", kMaxWaiting, kMaxWaitingOfTenant)) {}

  /// Runs `body`, void(const access::Caller&), on the pool; a call that is refused is finished at once.
  template <typename Body>
  void run(grpc::CallbackServerContext* context, grpc::ServerUnaryReactor* reactor, Body body) {
    Admission admission = gate_.admit(*context);
    // The pool's tasks can be copied, a slot cannot.
    auto slot = std::make_shared<CallSlots::Slot>(waiting_->take(admission));
    if (!admission.status.ok()) return reactor->Finish(admission.status);
    pool_.post([body = std::move(body), caller = std::move(admission.caller), slot = std::move(slot)] {
      slot->give_back();
      body(caller);
    });
  }

  /// Runs `body`, grpc::Status(const access::Caller&), on the pool and finishes the call with what it returns.
  template <typename Body>
  grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context, Body body) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    run(context, reactor,
        [reactor, body = std::move(body)](const access::Caller& caller) { reactor->Finish(body(caller)); });
    return reactor;
  }

 private:
  static constexpr std::uint64_t kMaxWaiting = 1024, kMaxWaitingOfTenant = 512;

  const Gate& gate_;
  store::TaskPool& pool_;
  const std::shared_ptr<CallSlots> waiting_;
};

}  // namespace radbake::service
