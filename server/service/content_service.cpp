#include "server/service/content_service.h"

#include <utility>

#include "server/service/convert.h"
#include "server/service/download_reactor.h"
#include "server/service/status.h"
#include "server/service/upload_reactor.h"

namespace radbake::service {

grpc::ServerUnaryReactor* ContentService::FindMissing(grpc::CallbackServerContext* context,
                                                      const v1::FindMissingRequest* request,
                                                      v1::FindMissingResponse* response) {
  return calls_.answer(context, [this, request, response](const access::Caller& caller) {
    return find_missing(caller, *request, *response);
  });
}

grpc::Status ContentService::find_missing(const access::Caller& caller, const v1::FindMissingRequest& request,
                                          v1::FindMissingResponse& response) {
  const auto num_digests = static_cast<std::uint64_t>(request.digests_size());
  if (num_digests > limits_.max_digests_per_call) {
    return above_limit("max_digests_per_call", num_digests, limits_.max_digests_per_call);
  }
  std::vector<Digest> digests;
  for (const v1::Digest& digest : request.digests()) {
    digests.push_back(from_message(digest));
    if (auto valid = validate_sha256(digests.back().sha256); !valid.ok()) {
      return bad_field("digests", valid.error().message);
    }
  }
  const auto content = content_.of(caller.tenant);
  if (!content.ok()) return to_status(content.error());
  for (const Digest& digest : (*content)->find_missing(digests)) *response.add_missing() = to_message(digest);
  return grpc::Status::OK;
}

grpc::ServerBidiReactor<v1::UploadChunk, v1::UploadResult>* ContentService::Upload(
    grpc::CallbackServerContext* context) {
  Admission admission = gate_.admit(*context);
  auto slot = uploads_->take(admission);
  return new UploadReactor(admission, std::move(slot), content_, pool_, disk_, limits_);
}

grpc::ServerUnaryReactor* ContentService::QueryUpload(grpc::CallbackServerContext* context,
                                                      const v1::QueryUploadRequest* request,
                                                      v1::QueryUploadResponse* response) {
  return calls_.answer(context, [this, request, response](const access::Caller& caller) {
    return query_upload(caller, *request, *response);
  });
}

grpc::Status ContentService::query_upload(const access::Caller& caller, const v1::QueryUploadRequest& request,
                                          v1::QueryUploadResponse& response) {
  const Digest digest = from_message(request.digest());
  if (auto valid = validate_sha256(digest.sha256); !valid.ok()) return bad_field("digest", valid.error().message);
  const auto content = content_.of(caller.tenant);
  if (!content.ok()) return to_status(content.error());
  const store::UploadProgress progress = (*content)->query_upload(digest);
  response.set_committed_bytes(progress.committed_bytes);
  response.set_complete(progress.is_complete);
  return grpc::Status::OK;
}

grpc::ServerWriteReactor<v1::DownloadChunk>* ContentService::Download(grpc::CallbackServerContext* context,
                                                                      const v1::DownloadRequest* request) {
  Admission admission = gate_.admit(*context);
  auto slot = downloads_->take(admission);
  return new DownloadReactor(admission, std::move(slot), content_, pool_, limits_.chunk_bytes, *request);
}

}  // namespace radbake::service
