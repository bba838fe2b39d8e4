#pragma once

#include <grpcpp/grpcpp.h>

#include <optional>

#include "common/base/limits.h"
#include "radbake/v1/content.pb.h"
#include "server/service/call_slots.h"
#include "server/service/disk_watch.h"
#include "server/service/gate.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

/// One Upload call. Either one read or one write is outstanding, or one task runs on the pool, so nothing here needs a
/// lock; the next chunk is asked for when the last one is on its way to the disk. A cancelled call shows as a failed
/// read. Deletes itself.
class UploadReactor : public grpc::ServerBidiReactor<v1::UploadChunk, v1::UploadResult> {
 public:
  UploadReactor(const Admission& admission, CallSlots::Slot slot, store::TenantContent& content, store::TaskPool& pool,
                const DiskWatch& disk, const Limits& limits);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  /// Stores the chunk just read; the status to finish with, or none to read on.
  std::optional<grpc::Status> take_chunk();

  void end(const grpc::Status& status);

  CallSlots::Slot slot_;
  store::TenantContent& content_;
  const std::string tenant_;
  store::TaskPool& pool_;
  const DiskWatch& disk_;
  const Limits limits_;
  v1::UploadResult result_;
  v1::UploadChunk chunk_;
  store::ContentStore* store_ = nullptr;  // the tenant's, from the first chunk on
  std::optional<Digest> digest_;
  bool tells_progress_ = false, is_over_ = false;
  std::uint64_t next_offset_ = 0;
};

}  // namespace radbake::service
