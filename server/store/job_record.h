#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"

namespace radbake::store {

/// Where a job is in its life. The numbers are on disk and on the wire (radbake.v1.BakeState): never renumber.
enum class JobState {
  kQueued = 1,
  kPreparing = 2,
  kFormFactors = 3,
  kSolving = 4,
  kGathering = 5,
  kWriting = 6,
  kSucceeded = 7,
  kFailed = 8,
  kCancelled = 9,
};

inline bool is_terminal(JobState state) { return state >= JobState::kSucceeded; }
inline bool is_running(JobState state) { return state > JobState::kQueued && !is_terminal(state); }
const char* job_state_name(JobState state);

/// What a worker gets to do. Messages of the wire are kept as their bytes: the store and the jobs do not read them.
struct Work {
  Digest manifest;
  std::string settings;        ///< bytes of radbake.v1.BakeSettings
  std::string run;             ///< bytes of radbake.v1.RunOptions
  std::vector<Digest> inputs;  ///< every blob that the worker opens, the manifest among them
};

/// Whose a job is, and how it is to be treated.
struct JobOwner {
  std::string tenant = {};    ///< empty: the server knows no tenants
  std::string client = {};    ///< turns are shared out between clients: as it calls itself, within its tenant
  std::string trace_id = {};  ///< of the call that submitted it
  int priority = 0;           ///< higher: earlier
  bool is_shared = true;      ///< its run and its result serve every job of the tenant with the same bake key
};

/// A job before it is accepted.
struct NewJob {
  std::string request_id;   ///< the same again, of one tenant: the same job
  std::string body_sha256;  ///< of the request: the same id with another body is refused
  std::string label;
  std::string bake_key;
  Work work;
  JobOwner owner = {};
};

/// A job as it is stored.
struct JobRecord {
  std::int64_t id = 0;  ///< grows with every job
  std::string name;     ///< bakes/<16 hexadecimal digits>
  std::string label;
  std::string bake_key;
  Work work;
  JobOwner owner;
  JobState state = JobState::kQueued;
  std::uint32_t attempt = 1;          ///< the run of a worker that is going on, or the next one
  std::uint32_t lost_attempts = 0;    ///< how often the server died while the job ran, since its last checkpoint
  std::uint32_t failed_attempts = 0;  ///< how often its worker did
  std::uint64_t last_sequence = 0;    ///< of its events
  std::string result;                 ///< bytes of radbake.v1.BakeResult; kSucceeded only
  std::optional<Error> error;         ///< kFailed only
  std::int64_t created_unix_ms = 0;
  std::int64_t finished_unix_ms = 0;  ///< 0: not yet
  bool is_from_store = false;         ///< its result is that of an earlier job
};

/// A change of state, never lost and never repeated.
struct JobEvent {
  std::uint64_t sequence = 0;  ///< 1, 2, ... for each job
  std::int64_t unix_ms = 0;
  JobState state = JobState::kQueued;
  std::uint32_t attempt = 0;
  std::string message;  ///< for people
};

/// A change to be recorded: the event and everything that changes with it, in one transaction. Counts that are not set
/// stay as they are.
struct StateChange {
  JobState state = JobState::kQueued;
  std::string message = {};
  std::optional<std::uint32_t> attempt = {};
  std::optional<std::uint32_t> lost_attempts = {};
  std::optional<std::uint32_t> failed_attempts = {};
  std::string result = {};           ///< with kSucceeded
  std::optional<Error> error = {};   ///< with kFailed
  std::vector<Digest> outputs = {};  ///< with kSucceeded: every blob that the result names
  bool is_whole = true;              ///< with kSucceeded: false where somebody ended it early
};

/// What an attempt left for the next one.
struct CheckpointRecord {
  std::string name;  ///< within its bake
  Digest digest;
};

/// A change as it was recorded.
struct RecordedChange {
  JobRecord record;
  JobEvent event;
  std::vector<Digest> unneeded;  ///< blobs of checkpoints that ended with it
};

}  // namespace radbake::store
