#pragma once

#include <grpcpp/grpcpp.h>

#include <string>
#include <vector>

#include "common/base/limits.h"
#include "radbake/v1/content.pb.h"
#include "radbake/v1/settings.pb.h"
#include "server/store/content_store.h"
#include "server/store/job_record.h"

namespace radbake::service {

/// What a request to bake or to plan names.
struct SceneRequest {
  const v1::Digest& manifest;
  const v1::BakeSettings& settings;
  const v1::RunOptions& run;
};

/// Checks the bytes of a manifest: readable, its counts within the limits, digests well formed. Counts records before
/// it takes memory for them. `inputs`: every blob that it names once, itself (its own digest) first.
grpc::Status check_manifest(const std::string& bytes, const Digest& digest, const Limits& limits,
                            std::vector<Digest>& inputs);

/// Checks a request before anything is queued: settings in range, the manifest (the only bytes of a client that this
/// process parses) readable, its counts within the limits, every blob that it names present. Fills `work`.
/// max_threads: the server's own bound; 0: none.
grpc::Status check_scene(const SceneRequest& request, const Limits& limits, std::uint32_t max_threads,
                         const store::ContentStore& content, store::Work& work);

/// Digest of all that decides a result: manifest, settings and the engine's version.
std::string make_bake_key(const store::Work& work);

}  // namespace radbake::service
