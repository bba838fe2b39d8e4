#include "server/service/upload_reactor.h"

#include "server/service/convert.h"
#include "server/service/status.h"

namespace radbake::service {

UploadReactor::UploadReactor(const grpc::Status& admission, store::ContentStore& content, store::TaskPool& pool,
                             const DiskWatch& disk, const Limits& limits, v1::UploadResult* result)
    : content_(content), pool_(pool), disk_(disk), limits_(limits), result_(result) {
  if (!admission.ok()) {
    Finish(admission);
  } else {
    StartRead(&chunk_);
  }
}

void UploadReactor::OnReadDone(bool ok) {
  if (!ok) return Finish(bad_field("finish", "the upload ended before its last chunk"));
  pool_.post([this] {
    // After Finish or StartRead this object may be gone or busy: touch nothing.
    if (const auto status = take_chunk()) {
      Finish(*status);
    } else {
      StartRead(&chunk_);
    }
  });
}

std::optional<grpc::Status> UploadReactor::take_chunk() {
  if (!digest_) {
    digest_ = from_message(chunk_.digest());
    next_offset_ = chunk_.offset();
    if (auto valid = validate_sha256(digest_->sha256); !valid.ok()) return bad_field("digest", valid.error().message);
    if (content_.contains(*digest_)) {
      result_->set_committed_bytes(digest_->size_bytes);
      result_->set_already_present(true);
      return grpc::Status::OK;
    }
  }
  if (auto room = disk_.admit(); !room.ok()) return to_status(room.error(), "min_free_disk_bytes");
  if (chunk_.data().size() > limits_.chunk_bytes) {
    return above_limit("chunk_bytes", chunk_.data().size(), limits_.chunk_bytes);
  }
  if (chunk_.offset() != next_offset_) {
    return grpc::Status(grpc::StatusCode::OUT_OF_RANGE, "blob " + digest_->sha256 + ": a chunk at offset " +
                                                            std::to_string(chunk_.offset()) + " follows bytes up to " +
                                                            std::to_string(next_offset_));
  }
  const auto committed = content_.append_upload(*digest_, chunk_.offset(), std::as_bytes(std::span(chunk_.data())));
  if (!committed.ok()) {
    // The store's only precondition is that there is no gap.
    if (committed.error().code == ErrorCode::kFailedPrecondition) {
      return grpc::Status(grpc::StatusCode::OUT_OF_RANGE, committed.error().message);
    }
    return to_status(committed.error(), "max_blob_bytes");
  }
  next_offset_ += chunk_.data().size();
  if (!chunk_.finish()) return std::nullopt;
  if (auto finished = content_.finish_upload(*digest_); !finished.ok()) {
    return to_status(finished.error(), "max_blob_bytes");
  }
  result_->set_committed_bytes(digest_->size_bytes);
  return grpc::Status::OK;
}

}  // namespace radbake::service
