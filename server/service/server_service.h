#pragma once

#include "common/base/limits.h"
#include "radbake/v1/server.grpc.pb.h"
#include "server/service/unary_calls.h"

namespace radbake::service {

/// radbake.v1.Server: what this server can do, and its limits.
class ServerService : public v1::Server::CallbackService {
 public:
  ServerService(UnaryCalls& calls, const Limits& limits) : calls_(calls), limits_(limits) {}

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::Capabilities* capabilities) override;

 private:
  grpc::Status describe(v1::Capabilities& capabilities) const;

  UnaryCalls& calls_;
  const Limits limits_;
};

}  // namespace radbake::service
