#include "server/service/server_service.h"

#include <thread>

#include "common/base/version.h"

namespace radbake::service {

grpc::ServerUnaryReactor* ServerService::GetCapabilities(grpc::CallbackServerContext* context,
                                                         const v1::GetCapabilitiesRequest*,
                                                         v1::Capabilities* capabilities) {
  return calls_.answer(context, [this, capabilities](const access::Caller&) { return describe(*capabilities); });
}

grpc::Status ServerService::describe(v1::Capabilities& capabilities) const {
  capabilities.set_engine_version(kEngineVersion);
  capabilities.set_protocol_major(kProtocolMajor);
  capabilities.set_protocol_minor(kProtocolMinor);
  *capabilities.mutable_limits() = limits_message<v1::Limits>(limits_);
  capabilities.add_outputs("lightmap");
  capabilities.add_estimators("hemisphere");
  capabilities.add_transports("sparse");
  capabilities.add_solvers("gauss-seidel");
  for (const char* light : {"emitters", "sky", "sun", "point", "spot", "ies", "directional"}) {
    capabilities.add_lights(light);
  }
  capabilities.set_cores(std::thread::hardware_concurrency());
  return grpc::Status::OK;
}

}  // namespace radbake::service
