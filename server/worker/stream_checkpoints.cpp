#include "server/worker/stream_checkpoints.h"

#include <spdlog/spdlog.h>

#include "server/worker/send_blob.h"

namespace radbake::worker {
namespace {

/// What a crash may cost, where nobody says otherwise.
constexpr double kDefaultIntervalSeconds = 10;

}  // namespace

StreamCheckpoints::StreamCheckpoints(const v1::StartWork& start, const InputBlobs& inputs, std::uint64_t chunk_bytes,
                                     ReportStream& stream)
    : inputs_(inputs),
      chunk_bytes_(chunk_bytes),
      stream_(stream),
      interval_(start.run().checkpoint_ms() > 0 ? start.run().checkpoint_ms() / 1000.0 : kDefaultIntervalSeconds) {
  for (const v1::Checkpoint& checkpoint : start.checkpoints()) {
    kept_[checkpoint.name()] = Digest{checkpoint.digest().sha256(), checkpoint.digest().size_bytes()};
  }
}

std::vector<std::string> StreamCheckpoints::names() const {
  std::vector<std::string> names;
  for (const auto& [name, digest] : kept_) names.push_back(name);
  return names;
}

std::optional<std::string> StreamCheckpoints::load(const std::string& name) {
  const auto found = kept_.find(name);
  if (found == kept_.end() || !found->second) return std::nullopt;
  Result<std::string> bytes = inputs_.read(*found->second);
  // They decide the result as much as the scene does: look twice.
  if (!bytes.ok() || digest_of(*bytes) != *found->second) {
    const std::string why = bytes.ok() ? "it is not as it was kept" : bytes.error().message;
    spdlog::warn("checkpoint '{}' cannot be gone on from, that part is made again: {}", name, why);
    return std::nullopt;
  }
  spdlog::info("goes on from checkpoint '{}' of {} bytes", name, bytes->size());
  return std::move(bytes).value();
}

void StreamCheckpoints::save(const std::string& name, const std::string& bytes) {
  // Where there is no memory to send it, fail while nothing is sent: a blob that breaks off cannot be begun again.
  constexpr std::uint64_t kChunksAtOnce = 16;
  std::string(kChunksAtOnce * std::min<std::uint64_t>(chunk_bytes_, bytes.size()), '\0');
  // A server that is gone stops the bake by its token.
  (void)
      send_blob(name, BlobUse::kCheckpoint, std::as_bytes(std::span(bytes)), chunk_bytes_, stream_, [](std::uint64_t) {
      }).ok();
  kept_[name] = std::nullopt;
}

void StreamCheckpoints::drop(const std::vector<std::string>& names) {
  v1::WorkerReport report;
  for (const std::string& name : names) {
    kept_.erase(name);
    report.mutable_drop_checkpoints()->add_names(name);
  }
  stream_.send(std::move(report));
}

void StreamCheckpoints::warn(const std::string& text) {
  if (warnings_.insert(text).second) spdlog::warn("checkpoints: {}", text);
}

}  // namespace radbake::worker
