#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "radbake/v1/worker.pb.h"
#include "server/worker/report_stream.h"

namespace radbake::worker {

enum class BlobUse { kResult, kCheckpoint };

/// The error of a bake whose server is gone.
Error server_gone();

/// Sends a blob in parts of at most chunk_bytes, calls back with the bytes of each, and returns its digest. One blob at
/// a time. Errors: kUnavailable when the server is gone.
Result<v1::Digest> send_blob(const std::string& name, BlobUse use, std::span<const std::byte> bytes,
                             std::uint64_t chunk_bytes, ReportStream& stream,
                             const std::function<void(std::uint64_t)>& on_sent);

}  // namespace radbake::worker
