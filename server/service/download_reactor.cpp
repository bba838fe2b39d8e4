#include "server/service/download_reactor.h"

#include <algorithm>
#include <utility>

#include "server/service/convert.h"
#include "server/service/status.h"

namespace radbake::service {

DownloadReactor::DownloadReactor(const grpc::Status& admission, store::ContentStore& content, store::TaskPool& pool,
                                 std::uint64_t chunk_bytes, v1::DownloadRequest request)
    : content_(content), pool_(pool), chunk_bytes_(chunk_bytes), request_(std::move(request)) {
  if (!admission.ok()) {
    Finish(admission);
  } else {
    pool_.post([this] { open(); });
  }
}

void DownloadReactor::open() {
  const Digest digest = from_message(request_.digest());
  if (auto valid = validate_sha256(digest.sha256); !valid.ok()) {
    return Finish(bad_field("digest", valid.error().message));
  }
  auto file = content_.open_blob(digest);
  if (!file.ok()) return Finish(to_status(file.error()));
  file_ = std::move(file).value();
  position_ = request_.offset();
  if (position_ > digest.size_bytes) {
    return Finish(grpc::Status(grpc::StatusCode::OUT_OF_RANGE,
                               "offset " + std::to_string(position_) + " is beyond the " +
                                   std::to_string(digest.size_bytes) + " bytes of blob " + digest.sha256));
  }
  const std::uint64_t rest = digest.size_bytes - position_;
  end_ = position_ + (request_.limit() == 0 ? rest : std::min<std::uint64_t>(request_.limit(), rest));
  send_next();
}

void DownloadReactor::send_next() {
  if (position_ == end_) return Finish(grpc::Status::OK);
  const std::string& sha256 = request_.digest().sha256();
  auto bytes = store::read_range(file_.get(), position_, std::min(chunk_bytes_, end_ - position_), sha256);
  if (!bytes.ok()) return Finish(to_status(bytes.error()));
  if (bytes->empty()) {
    return Finish(to_status({ErrorCode::kDataLoss, "blob " + sha256 + " has lost bytes on the server's disk"}));
  }
  chunk_.set_offset(position_);
  position_ += bytes->size();
  chunk_.set_data(std::move(bytes).value());
  StartWrite(&chunk_);
}

void DownloadReactor::OnWriteDone(bool ok) {
  if (!ok) return Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the reader has gone"));
  pool_.post([this] { send_next(); });
}

}  // namespace radbake::service
