#pragma once

#include <grpcpp/grpcpp.h>

#include "radbake/v1/content.pb.h"
#include "server/service/call_slots.h"
#include "server/service/gate.h"
#include "server/store/file_descriptor.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

/// One Download call. Either one write is outstanding or one task runs on the pool, never both; a slow reader costs one
/// chunk. Deletes itself.
class DownloadReactor : public grpc::ServerWriteReactor<v1::DownloadChunk> {
 public:
  DownloadReactor(const Admission& admission, CallSlots::Slot slot, store::TenantContent& content,
                  store::TaskPool& pool, std::uint64_t chunk_bytes, v1::DownloadRequest request);

  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  void open();
  void send_next();

  void end(const grpc::Status& status);

  CallSlots::Slot slot_;
  store::TenantContent& content_;
  const std::string tenant_;
  store::TaskPool& pool_;
  const std::uint64_t chunk_bytes_;
  const v1::DownloadRequest request_;
  store::FileDescriptor file_;
  std::uint64_t position_ = 0;
  std::uint64_t end_ = 0;
  v1::DownloadChunk chunk_;
};

}  // namespace radbake::service
