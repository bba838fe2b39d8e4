#pragma once

#include <grpcpp/grpcpp.h>

#include "radbake/v1/content.pb.h"
#include "server/store/content_store.h"
#include "server/store/file_descriptor.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// One Download call. Either one write is outstanding or one task runs on the pool, never both; a slow reader costs one
/// chunk. Deletes itself.
class DownloadReactor : public grpc::ServerWriteReactor<v1::DownloadChunk> {
 public:
  DownloadReactor(const grpc::Status& admission, store::ContentStore& content, store::TaskPool& pool,
                  std::uint64_t chunk_bytes, v1::DownloadRequest request);

  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  void open();
  void send_next();

  store::ContentStore& content_;
  store::TaskPool& pool_;
  const std::uint64_t chunk_bytes_;
  const v1::DownloadRequest request_;
  store::FileDescriptor file_;
  std::uint64_t position_ = 0;
  std::uint64_t end_ = 0;
  v1::DownloadChunk chunk_;
};

}  // namespace radbake::service
