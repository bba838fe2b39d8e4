#pragma once

#include "common/base/limits.h"
#include "radbake/v1/content.grpc.pb.h"
#include "server/service/disk_watch.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

/// radbake.v1.Content over the content store. Everything that touches the disk runs on the pool.
class ContentService : public v1::Content::CallbackService {
 public:
  ContentService(store::TenantContent& content, store::TaskPool& pool, const DiskWatch& disk, const Limits& limits)
      : content_(content), pool_(pool), disk_(disk), limits_(limits) {}

  grpc::ServerUnaryReactor* FindMissing(grpc::CallbackServerContext* context, const v1::FindMissingRequest* request,
                                        v1::FindMissingResponse* response) override;
  grpc::ServerReadReactor<v1::UploadChunk>* Upload(grpc::CallbackServerContext* context,
                                                   v1::UploadResult* result) override;
  grpc::ServerUnaryReactor* QueryUpload(grpc::CallbackServerContext* context, const v1::QueryUploadRequest* request,
                                        v1::QueryUploadResponse* response) override;
  grpc::ServerWriteReactor<v1::DownloadChunk>* Download(grpc::CallbackServerContext* context,
                                                        const v1::DownloadRequest* request) override;

 private:
  store::TenantContent& content_;
  store::TaskPool& pool_;
  const DiskWatch& disk_;
  const Limits limits_;
};

}  // namespace radbake::service
