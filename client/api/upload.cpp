#include <algorithm>
#include <map>

#include "client/api/connection.h"
#include "common/base/version.h"

namespace radbake::api {
namespace {

/// What gRPC carries best over one stream, and what a server takes unless it says less.
constexpr std::uint64_t kChunkBytes = 128 << 10;
constexpr std::uint64_t kDigestsPerCall = 1000;

/// The server's limit, where it names one that is lower.
std::uint64_t at_most(std::uint64_t ours, std::uint64_t limit) { return limit == 0 ? ours : std::min(ours, limit); }

void fill(const Digest& from, v1::Digest* to) {
  to->set_sha256(from.sha256);
  to->set_size_bytes(from.size_bytes);
}

/// Sends one blob, resuming where the server says.
class Upload {
 public:
  Upload(const Connection& connection, const BlobView& blob, std::stop_token stop)
      : connection_(connection),
        blob_(blob),
        stop_(std::move(stop)),
        chunk_bytes_(at_most(kChunkBytes, connection.capabilities.limits().chunk_bytes())),
        backoff_(connection.options, connection.options.stream_patience) {}

  /// `on_sent(offset)`: bytes of the blob handed to the stream so far.
  Result<void> run(const std::function<void(std::uint64_t)>& on_sent) {
    // An earlier run may have sent most of a large blob.
    if (blob_.bytes.size() > chunk_bytes_) RADBAKE_RETURN_IF_ERROR(find_offset());
    while (!is_complete_) {
      const grpc::Status status = send(on_sent);
      if (stop_.stop_requested()) return stopped();
      if (status.ok()) break;
      const Error error = connection_.describe(status);
      // OUT_OF_RANGE: the server has restarted and forgot its part of the blob.
      const bool try_again =
          error.code == ErrorCode::kUnavailable || status.error_code() == grpc::StatusCode::OUT_OF_RANGE;
      if (!try_again || !backoff_.wait(stop_)) return stop_.stop_requested() ? stopped() : error;
      const std::uint64_t before = furthest_;
      RADBAKE_RETURN_IF_ERROR(find_offset());
      if (furthest_ > before) backoff_.reset();
    }
    on_sent(blob_.bytes.size());
    return {};
  }

 private:
  /// Asks how much the server has.
  Result<void> find_offset() {
    v1::QueryUploadRequest request;
    fill(blob_.digest, request.mutable_digest());
    RADBAKE_ASSIGN_OR_RETURN(const v1::QueryUploadResponse answer,
                             call_with_retries<v1::QueryUploadResponse>(connection_, connection_.options.call_deadline,
                                                                        stop_, [&](auto* context, auto* response) {
                                                                          return connection_.content->QueryUpload(
                                                                              context, request, response);
                                                                        }));
    is_complete_ = answer.complete();
    offset_ = std::min<std::uint64_t>(answer.committed_bytes(), blob_.bytes.size());
    furthest_ = std::max(furthest_, offset_);
    return {};
  }

  grpc::Status send(const std::function<void(std::uint64_t)>& on_sent) {
    Call call(connection_, stop_);
    const auto stream = connection_.content->Upload(&call.context());
    v1::UploadResult result;
    v1::UploadChunk chunk;
    fill(blob_.digest, chunk.mutable_digest());
    // An older server would not answer, and we wait for ever.
    const bool wants_answers = connection_.capabilities.protocol_minor() >= kAnswersChunksMinor;
    chunk.set_wants_progress(wants_answers);
    std::uint64_t offset = offset_;
    bool is_last = false;
    // An empty blob is one empty chunk.
    while (!is_last) {
      const std::uint64_t size = std::min(chunk_bytes_, blob_.bytes.size() - offset);
      is_last = offset + size == blob_.bytes.size();
      chunk.set_offset(offset);
      chunk.set_data(blob_.bytes.data() + offset, size);
      chunk.set_finish(is_last);
      // A write or an answer that fails means that the server has ended the stream: Finish says why.
      if (!stream->Write(chunk)) break;
      offset += size;
      on_sent(offset);
      // What is on its way when the connection breaks has to be sent again: never more than this chunk.
      if (wants_answers && (!stream->Read(&result) || result.already_present())) break;
      chunk.Clear();
    }
    stream->WritesDone();
    while (stream->Read(&result)) continue;
    const grpc::Status status = stream->Finish();
    if (status.ok() && !result.already_present() && result.committed_bytes() != blob_.bytes.size()) {
      return {grpc::StatusCode::INTERNAL, "the server stored " + std::to_string(result.committed_bytes()) + " of the " +
                                              std::to_string(blob_.bytes.size()) + " bytes of blob " +
                                              blob_.digest.sha256};
    }
    return status;
  }

  const Connection& connection_;
  const BlobView& blob_;
  std::stop_token stop_;
  std::uint64_t chunk_bytes_;
  Backoff backoff_;
  std::uint64_t offset_ = 0;
  std::uint64_t furthest_ = 0;
  bool is_complete_ = false;
};

}  // namespace

Result<std::uint64_t> Client::upload_missing(std::span<const BlobView> blobs, const UploadProgress& progress,
                                             std::stop_token stop) {
  std::map<std::string, const BlobView*> by_digest;
  for (const BlobView& blob : blobs) by_digest[blob.digest.sha256] = &blob;

  // Ask for what is missing, as many digests a call as the server takes.
  const std::size_t batch = at_most(kDigestsPerCall, capabilities().limits().max_digests_per_call());
  std::vector<const BlobView*> missing;
  std::uint64_t total_bytes = 0;
  for (std::size_t begin = 0; begin < blobs.size(); begin += batch) {
    v1::FindMissingRequest request;
    for (const BlobView& blob : blobs.subspan(begin, std::min(batch, blobs.size() - begin))) {
      fill(blob.digest, request.add_digests());
    }
    RADBAKE_ASSIGN_OR_RETURN(
        const v1::FindMissingResponse answer,
        call_with_retries<v1::FindMissingResponse>(
            *connection_, connection_->options.call_deadline, stop, [&](auto* context, auto* response) {
              return connection_->content->FindMissing(context, request, response);
            }));
    for (const v1::Digest& digest : answer.missing()) {
      const auto found = by_digest.find(digest.sha256());
      if (found == by_digest.end()) {
        return internal_error("the server asks for blob " + digest.sha256() + ", which it was not told of");
      }
      missing.push_back(found->second);
      total_bytes += found->second->bytes.size();
      // Of two blobs with one digest, one is sent.
      by_digest.erase(found);
    }
  }

  std::uint64_t done_bytes = 0;
  for (const BlobView* blob : missing) {
    Upload upload(*connection_, *blob, stop);
    RADBAKE_RETURN_IF_ERROR(upload.run([&](std::uint64_t offset) {
      if (progress) progress(done_bytes + offset, total_bytes);
    }));
    done_bytes += blob->bytes.size();
  }
  return done_bytes;
}

}  // namespace radbake::api
