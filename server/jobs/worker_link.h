#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "server/store/file_descriptor.h"
#include "server/store/job_record.h"

namespace radbake::jobs {

/// How a worker introduces itself.
struct WorkerHello {
  std::string job;
  std::uint32_t attempt = 0;
  std::string engine_version;
  std::uint32_t protocol_major = 0;
};

/// An input that the worker inherits as an open read-only descriptor.
struct InputFile {
  Digest digest;
  int fd = -1;
};

/// What an earlier attempt left, open for this one. Descriptors come after those of the inputs.
struct CheckpointFile {
  std::string name;
  InputFile file;
};

/// What a worker is told to do.
struct WorkOrder {
  bool is_plan = false;
  store::Work work;
  std::vector<InputFile> inputs;
  std::vector<CheckpointFile> checkpoints;
  double waited_seconds = 0;  ///< since the job was accepted
  std::string trace_id;       ///< of the call that asked for it
};

/// Part of a result blob. Parts follow each other without a gap.
struct ResultChunk {
  std::string blob;  ///< name within this attempt
  std::uint64_t offset = 0;
  const std::string& bytes;
  std::optional<Digest> digest;  ///< with the last part
  bool is_checkpoint = false;    ///< not a result, but for another attempt
};

/// How a worker says that its work ended.
struct WorkOutcome {
  enum class Kind { kSucceeded, kFailed, kCancelled };
  Kind kind = Kind::kSucceeded;
  std::string result;                ///< bytes of radbake.v1.BakeResult or Plan; kSucceeded only
  Error error;                       ///< kFailed only
  std::vector<Digest> outputs = {};  ///< that the result names
};

/// The way to one worker. The service implements it over the wire; calls do not block and may come from any thread.
class WorkerLink {
 public:
  virtual ~WorkerLink() = default;
  virtual void start(const WorkOrder& order) = 0;
  virtual void cancel() = 0;
  /// The best result so far will do.
  virtual void finish() = 0;
  /// Everything reported is stored: the worker may exit.
  virtual void accept() = 0;
};

/// Takes the server's end of a worker's socket and speaks the wire protocol on it.
class WorkerGate {
 public:
  virtual ~WorkerGate() = default;
  virtual void adopt(store::FileDescriptor socket) = 0;
};

}  // namespace radbake::jobs
