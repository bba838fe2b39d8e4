#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_interceptor.h>

#include <string>

#include "server/service/metrics.h"

namespace radbake::service {

/// Stands around every call of a server: gives it a trace, counts it, and logs how it ended.
///
/// A call without a well-formed traceparent is given one of its own, which its handler finds in the same place. Calls
/// that went well are logged at level debug, refused ones at info, the server's own failures at error.
class RpcWatch : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit RpcWatch(Metrics& metrics) : metrics_(metrics) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  Metrics& metrics_;
};

/// The trace id of a call; empty outside of an RpcWatch for a call that brings none.
std::string trace_id_of(const grpc::CallbackServerContext& context);

/// "DEADLINE_EXCEEDED".
const char* code_name(grpc::StatusCode code);

}  // namespace radbake::service
