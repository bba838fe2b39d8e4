#include "client/cli/requests.h"

#include "client/api/client.h"
#include "client/cli/proto_json.h"

namespace radbake::cli {
namespace {

/// The fields that both requests have.
template <typename Request>
Request request_of(const CommandLine& line, const Digest& manifest) {
  Request request;
  request.mutable_manifest()->set_sha256(manifest.sha256);
  request.mutable_manifest()->set_size_bytes(manifest.size_bytes);
  *request.mutable_settings() = options::to_settings(line.bake);
  *request.mutable_run() = options::to_run_options(line.bake);
  return request;
}

}  // namespace

v1::SubmitBakeRequest submit_request(const CommandLine& line, const Digest& manifest) {
  auto request = request_of<v1::SubmitBakeRequest>(line, manifest);
  request.set_request_id(api::make_request_id());
  request.set_priority(line.priority);
  request.set_no_cache(line.no_cache);
  // Protobuf's texts are UTF-8, file names are bytes.
  request.set_label(to_utf8(line.scene.filename().string()));
  return request;
}

v1::PlanBakeRequest plan_request(const CommandLine& line, const Digest& manifest) {
  return request_of<v1::PlanBakeRequest>(line, manifest);
}

}  // namespace radbake::cli
