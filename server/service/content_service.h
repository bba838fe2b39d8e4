#pragma once

#include "common/base/limits.h"
#include "radbake/v1/content.grpc.pb.h"
#include "server/service/call_slots.h"
#include "server/service/disk_watch.h"
#include "server/service/gate.h"
#include "server/service/unary_calls.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

/// radbake.v1.Content over the content of tenants, each of which sees its own alone. Everything that touches the disk
/// runs on the pool.
class ContentService : public v1::Content::CallbackService {
 public:
  ContentService(const Gate& gate, UnaryCalls& calls, store::TenantContent& content, store::TaskPool& pool,
                 const DiskWatch& disk, const Limits& limits)
      : gate_(gate),
        calls_(calls),
        content_(content),
        pool_(pool),
        disk_(disk),
        limits_(limits),
        uploads_(CallSlots::make("max_uploads", limits.max_uploads, limits.max_uploads_per_tenant)),
        downloads_(CallSlots::make("max_downloads", limits.max_downloads, limits.max_downloads_per_tenant)) {}

  grpc::ServerUnaryReactor* FindMissing(grpc::CallbackServerContext* context, const v1::FindMissingRequest* request,
                                        v1::FindMissingResponse* response) override;
  grpc::ServerBidiReactor<v1::UploadChunk, v1::UploadResult>* Upload(grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* QueryUpload(grpc::CallbackServerContext* context, const v1::QueryUploadRequest* request,
                                        v1::QueryUploadResponse* response) override;
  grpc::ServerWriteReactor<v1::DownloadChunk>* Download(grpc::CallbackServerContext* context,
                                                        const v1::DownloadRequest* request) override;

 private:
  grpc::Status find_missing(const access::Caller& caller, const v1::FindMissingRequest& request,
                            v1::FindMissingResponse& response);
  grpc::Status query_upload(const access::Caller& caller, const v1::QueryUploadRequest& request,
                            v1::QueryUploadResponse& response);

  const Gate& gate_;
  UnaryCalls& calls_;
  store::TenantContent& content_;
  store::TaskPool& pool_;
  const DiskWatch& disk_;
  const Limits limits_;
  const std::shared_ptr<CallSlots> uploads_, downloads_;
};

}  // namespace radbake::service
