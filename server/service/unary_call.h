#pragma once

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/service/gate.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// Runs an admitted call on the pool and finishes it with the status that it returns.
/// `body`: grpc::Status(const access::Caller&).
template <typename Body>
grpc::ServerUnaryReactor* answer_on_pool(store::TaskPool& pool, const Gate& gate, grpc::CallbackServerContext* context,
                                         Body body) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  pool.post([&gate, context, reactor, body = std::move(body)] {
    const Admission admission = gate.admit(*context);
    reactor->Finish(admission.status.ok() ? body(admission.caller) : admission.status);
  });
  return reactor;
}

}  // namespace radbake::service
