#include "server/worker/send_blob.h"

#include <algorithm>
#include <utility>

#include "common/base/digest.h"

namespace radbake::worker {

Error server_gone() { return {ErrorCode::kUnavailable, "the server is gone"}; }

Result<v1::Digest> send_blob(const std::string& name, BlobUse use, std::span<const std::byte> bytes,
                             std::uint64_t chunk_bytes, ReportStream& stream,
                             const std::function<void(std::uint64_t)>& on_sent) {
  const Digest digest = digest_of(bytes);
  v1::Digest message;
  message.set_sha256(digest.sha256);
  message.set_size_bytes(digest.size_bytes);
  std::uint64_t offset = 0;
  do {
    const auto part = bytes.subspan(offset, std::min<std::uint64_t>(chunk_bytes, bytes.size() - offset));
    v1::WorkerReport report;
    v1::ResultBlobChunk& chunk = *report.mutable_chunk();
    chunk.set_blob(name);
    chunk.set_is_checkpoint(use == BlobUse::kCheckpoint);
    chunk.set_offset(offset);
    chunk.set_data(part.data(), part.size());
    offset += part.size();
    if (offset == bytes.size()) {
      chunk.set_finish(true);
      *chunk.mutable_digest() = message;
    }
    if (!stream.send(std::move(report))) return server_gone();
    on_sent(part.size());
  } while (offset < bytes.size());
  return message;
}

}  // namespace radbake::worker
