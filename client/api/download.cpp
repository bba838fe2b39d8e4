#include <algorithm>

#include "client/api/connection.h"

namespace radbake::api {
namespace {

/// Memory taken on the word of the server alone; beyond, it grows with what arrives.
constexpr std::uint64_t kMaxReserveBytes = 64 << 20;

Error data_loss(const Digest& digest, const std::string& what) {
  return {ErrorCode::kDataLoss,
          "blob " + digest.sha256 + " (" + std::to_string(digest.size_bytes) + " bytes): " + what};
}

}  // namespace

Result<std::string> Client::download(const Digest& digest, std::stop_token stop) {
  std::string bytes;
  bytes.reserve(std::min(digest.size_bytes, kMaxReserveBytes));
  Backoff backoff(connection_->options, connection_->options.stream_patience);
  while (true) {
    v1::DownloadRequest request;
    request.mutable_digest()->set_sha256(digest.sha256);
    request.mutable_digest()->set_size_bytes(digest.size_bytes);
    request.set_offset(bytes.size());
    Call call(*connection_, stop);
    const auto reader = connection_->content->Download(&call.context(), request);
    v1::DownloadChunk chunk;
    while (reader->Read(&chunk)) {
      if (chunk.offset() != bytes.size()) {
        abandon<v1::DownloadChunk>(call, *reader);
        return data_loss(digest, "the server sent byte " + std::to_string(chunk.offset()) + " where byte " +
                                     std::to_string(bytes.size()) + " follows");
      }
      if (chunk.data().size() > digest.size_bytes - bytes.size()) {
        abandon<v1::DownloadChunk>(call, *reader);
        return data_loss(digest, "the server sent more bytes than that");
      }
      bytes += chunk.data();
      backoff.reset();
    }
    const grpc::Status status = reader->Finish();
    if (stop.stop_requested()) return stopped();
    if (status.ok()) break;
    const Error error = connection_->describe(status);
    if (error.code != ErrorCode::kUnavailable || !backoff.wait(stop)) return stop.stop_requested() ? stopped() : error;
  }

  const Digest received = digest_of(bytes);
  if (received != digest) {
    return data_loss(digest, "received " + std::to_string(received.size_bytes) + " bytes of digest " + received.sha256);
  }
  return bytes;
}

}  // namespace radbake::api
