#include "server/service/download_reactor.h"

#include <algorithm>
#include <utility>

#include "server/service/convert.h"
#include "server/service/status.h"

namespace radbake::service {

DownloadReactor::DownloadReactor(const Admission& admission, CallSlots::Slot slot, store::TenantContent& content,
                                 store::TaskPool& pool, std::uint64_t chunk_bytes, v1::DownloadRequest request)
    : slot_(std::move(slot)),
      content_(content),
      tenant_(admission.caller.tenant),
      pool_(pool),
      chunk_bytes_(chunk_bytes),
      request_(std::move(request)) {
  if (!admission.status.ok()) {
    end(admission.status);
  } else {
    pool_.post([this] { open(); });
  }
}

void DownloadReactor::open() {
  const Digest digest = from_message(request_.digest());
  if (auto valid = validate_sha256(digest.sha256); !valid.ok()) {
    return end(bad_field("digest", valid.error().message));
  }
  const auto content = content_.of(tenant_);
  if (!content.ok()) return end(to_status(content.error()));
  auto file = (*content)->open_blob(digest);
  if (!file.ok()) return end(to_status(file.error()));
  file_ = std::move(file).value();
  position_ = request_.offset();
  if (position_ > digest.size_bytes) {
    return end(grpc::Status(grpc::StatusCode::OUT_OF_RANGE, "offset " + std::to_string(position_) + " is beyond the " +
                                                                std::to_string(digest.size_bytes) + " bytes of blob " +
                                                                digest.sha256));
  }
  const std::uint64_t rest = digest.size_bytes - position_;
  end_ = position_ + (request_.limit() == 0 ? rest : std::min<std::uint64_t>(request_.limit(), rest));
  send_next();
}

void DownloadReactor::send_next() {
  if (position_ == end_) return end(grpc::Status::OK);
  const std::string& sha256 = request_.digest().sha256();
  auto bytes = store::read_range(file_.get(), position_, std::min(chunk_bytes_, end_ - position_), sha256);
  if (!bytes.ok()) return end(to_status(bytes.error()));
  if (bytes->empty()) {
    return end(to_status({ErrorCode::kDataLoss, "blob " + sha256 + " has lost bytes on the server's disk"}));
  }
  chunk_.set_offset(position_);
  position_ += bytes->size();
  chunk_.set_data(std::move(bytes).value());
  StartWrite(&chunk_);
}

void DownloadReactor::OnWriteDone(bool ok) {
  if (!ok) return end(grpc::Status(grpc::StatusCode::CANCELLED, "the reader has gone"));
  pool_.post([this] { send_next(); });
}

void DownloadReactor::end(const grpc::Status& status) {
  slot_.give_back();
  Finish(status);
}

}  // namespace radbake::service
