#include "server/service/upload_reactor.h"

#include <utility>

#include "server/service/convert.h"
#include "server/service/status.h"

namespace radbake::service {

UploadReactor::UploadReactor(const Admission& admission, CallSlots::Slot slot, store::TenantContent& content,
                             store::TaskPool& pool, const DiskWatch& disk, const Limits& limits)
    : slot_(std::move(slot)),
      content_(content),
      tenant_(admission.caller.tenant),
      pool_(pool),
      disk_(disk),
      limits_(limits) {
  if (!admission.status.ok()) {
    end(admission.status);
  } else {
    StartRead(&chunk_);
  }
}

void UploadReactor::OnReadDone(bool ok) {
  if (!ok) return end(bad_field("finish", "the upload ended before its last chunk"));
  pool_.post([this] {
    // After Finish or StartRead this object may be gone or busy: touch nothing.
    if (const auto status = take_chunk()) {
      end(*status);
    } else if (tells_progress_) {
      StartWrite(&result_);
    } else {
      StartRead(&chunk_);
    }
  });
}

void UploadReactor::OnWriteDone(bool ok) {
  // After the last message nothing is read.
  if (is_over_) return;
  if (!ok) return end(grpc::Status(grpc::StatusCode::CANCELLED, "the uploader has gone"));
  StartRead(&chunk_);
}

std::optional<grpc::Status> UploadReactor::take_chunk() {
  if (!digest_) {
    digest_ = from_message(chunk_.digest());
    next_offset_ = chunk_.offset();
    tells_progress_ = chunk_.wants_progress();
    if (auto valid = validate_sha256(digest_->sha256); !valid.ok()) return bad_field("digest", valid.error().message);
    const auto content = content_.of(tenant_);
    if (!content.ok()) return to_status(content.error());
    store_ = *content;
    if (store_->contains(*digest_)) {
      result_.set_committed_bytes(digest_->size_bytes);
      result_.set_already_present(true);
      return grpc::Status::OK;
    }
  }
  if (auto room = disk_.admit(); !room.ok()) return to_status(room.error());
  if (chunk_.data().size() > limits_.chunk_bytes) {
    return above_limit("chunk_bytes", chunk_.data().size(), limits_.chunk_bytes);
  }
  if (chunk_.offset() != next_offset_) {
    return grpc::Status(grpc::StatusCode::OUT_OF_RANGE, "blob " + digest_->sha256 + ": a chunk at offset " +
                                                            std::to_string(chunk_.offset()) + " follows bytes up to " +
                                                            std::to_string(next_offset_));
  }
  const auto committed = store_->append_upload(*digest_, chunk_.offset(), std::as_bytes(std::span(chunk_.data())));
  if (!committed.ok()) {
    // The store's only precondition is that there is no gap.
    if (committed.error().code == ErrorCode::kFailedPrecondition) {
      return grpc::Status(grpc::StatusCode::OUT_OF_RANGE, committed.error().message);
    }
    return to_status(committed.error(), kDiskLimit);
  }
  next_offset_ += chunk_.data().size();
  result_.set_committed_bytes(*committed);
  if (!chunk_.finish()) return std::nullopt;
  if (auto finished = store_->finish_upload(*digest_); !finished.ok()) {
    return to_status(finished.error(), kDiskLimit);
  }
  result_.set_committed_bytes(digest_->size_bytes);
  return grpc::Status::OK;
}

void UploadReactor::end(const grpc::Status& status) {
  slot_.give_back();
  is_over_ = true;
  if (status.ok()) {
    StartWriteAndFinish(&result_, grpc::WriteOptions(), status);
  } else {
    Finish(status);
  }
}

}  // namespace radbake::service
