#include "server/service/content_service.h"

#include "server/service/convert.h"
#include "server/service/download_reactor.h"
#include "server/service/status.h"
#include "server/service/upload_reactor.h"

namespace radbake::service {

grpc::ServerUnaryReactor* ContentService::FindMissing(grpc::CallbackServerContext* context,
                                                      const v1::FindMissingRequest* request,
                                                      v1::FindMissingResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  pool_.post([this, context, request, response, reactor] {
    if (auto status = check_protocol(*context); !status.ok()) return reactor->Finish(status);
    const auto num_digests = static_cast<std::uint64_t>(request->digests_size());
    if (num_digests > limits_.max_digests_per_call) {
      return reactor->Finish(above_limit("max_digests_per_call", num_digests, limits_.max_digests_per_call));
    }
    std::vector<Digest> digests;
    for (const v1::Digest& digest : request->digests()) {
      digests.push_back(from_message(digest));
      if (auto valid = validate_sha256(digests.back().sha256); !valid.ok()) {
        return reactor->Finish(bad_field("digests", valid.error().message));
      }
    }
    const auto content = content_.of("");
    if (!content.ok()) return reactor->Finish(to_status(content.error()));
    for (const Digest& digest : (*content)->find_missing(digests)) *response->add_missing() = to_message(digest);
    reactor->Finish(grpc::Status::OK);
  });
  return reactor;
}

grpc::ServerReadReactor<v1::UploadChunk>* ContentService::Upload(grpc::CallbackServerContext* context,
                                                                 v1::UploadResult* result) {
  return new UploadReactor(check_protocol(*context), *content_.of("").value(), pool_, disk_, limits_, result);
}

grpc::ServerUnaryReactor* ContentService::QueryUpload(grpc::CallbackServerContext* context,
                                                      const v1::QueryUploadRequest* request,
                                                      v1::QueryUploadResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  pool_.post([this, context, request, response, reactor] {
    if (auto status = check_protocol(*context); !status.ok()) return reactor->Finish(status);
    const Digest digest = from_message(request->digest());
    if (auto valid = validate_sha256(digest.sha256); !valid.ok()) {
      return reactor->Finish(bad_field("digest", valid.error().message));
    }
    const store::UploadProgress progress = content_.of("").value()->query_upload(digest);
    response->set_committed_bytes(progress.committed_bytes);
    response->set_complete(progress.is_complete);
    reactor->Finish(grpc::Status::OK);
  });
  return reactor;
}

grpc::ServerWriteReactor<v1::DownloadChunk>* ContentService::Download(grpc::CallbackServerContext* context,
                                                                      const v1::DownloadRequest* request) {
  return new DownloadReactor(check_protocol(*context), *content_.of("").value(), pool_, limits_.chunk_bytes, *request);
}

}  // namespace radbake::service
