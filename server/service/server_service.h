#pragma once

#include "common/base/limits.h"
#include "radbake/v1/server.grpc.pb.h"
#include "server/service/gate.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// radbake.v1.Server: what this server can do, and its limits.
class ServerService : public v1::Server::CallbackService {
 public:
  ServerService(const Gate& gate, store::TaskPool& pool, const Limits& limits)
      : gate_(gate), pool_(pool), limits_(limits) {}

  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const v1::GetCapabilitiesRequest* request,
                                            v1::Capabilities* capabilities) override;

 private:
  grpc::Status describe(v1::Capabilities& capabilities) const;

  const Gate& gate_;
  store::TaskPool& pool_;
  const Limits limits_;
};

}  // namespace radbake::service
