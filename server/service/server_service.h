#pragma once

#include "common/base/limits.h"
#include "radbake/v1/server.grpc.pb.h"

namespace radbake::service {

/// radbake.v1.Server: what this server can do, and its limits.
class ServerService : public v1::Server::CallbackService {
 public:
  explicit ServerService(const Limits& limits) : limits_(limits) {}

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::Capabilities* capabilities) override;

 private:
  const Limits limits_;
};

}  // namespace radbake::service
