#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/store/job_record.h"
#include "server/store/sqlite.h"
#include "server/store/task_pool.h"

namespace radbake::store {

/// Jobs and their events in one SQLite file. What a function has returned survives a power loss.
///
/// Thread-safe: one thread of its own owns the database, callers wait for it (a commit forces the disk: milliseconds).
/// Errors: kInternal or kResourceExhausted (full disk) from the database; others are named at each function.
class JobStore {
 public:
  /// Opens the file, creates it where missing and brings an older one up to date.
  /// Errors: kFailedPrecondition for a file that a newer radbaked has written.
  static Result<std::unique_ptr<JobStore>> open(const std::filesystem::path& file);
  ~JobStore();

  /// The job that a request of a tenant created before. Errors: kAlreadyExists if its body was another.
  Result<std::optional<JobRecord>> find_request(const std::string& tenant, const std::string& request_id,
                                                const std::string& body_sha256);

  /// Stores a job in state kQueued with its first event; where there is a result `stored` for it, in state kSucceeded
  /// with that one. Errors: kAlreadyExists for a known request_id.
  Result<JobRecord> create(const NewJob& job, const JobRecord* stored = nullptr);

  /// Changes a job and appends the event of it, in one transaction; with the last unfinished job of a bake end its
  /// checkpoints. Errors: kNotFound.
  Result<RecordedChange> append_event(const std::string& name, const StateChange& change);

  /// Errors: kNotFound.
  Result<JobRecord> get(const std::string& name);
  Result<std::vector<JobEvent>> events_after(const std::string& name, std::uint64_t sequence);

  /// Newest first, of one tenant or of all, without results and inputs; before_id 0: from the newest on.
  Result<std::vector<JobRecord>> list(const std::optional<std::string>& tenant, std::uint32_t num_jobs,
                                      std::int64_t before_id);
  /// How many bakes of each client's ended since a time, but for those that the store answered.
  struct ClientCount {
    std::string tenant, client;
    std::uint64_t num_ended = 0;
  };
  Result<std::vector<ClientCount>> ended_by_client(std::int64_t since_unix_ms);
  /// Every job that has not ended, oldest first.
  Result<std::vector<JobRecord>> unfinished();

  // Blobs that jobs name: job_store_blobs.cpp.

  /// The newest job of a tenant that ended whole with the result of a bake key, and may be shared.
  Result<std::optional<JobRecord>> find_result(const std::string& tenant, const std::string& bake_key);
  /// Every blob that a job's result names.
  Result<std::vector<Digest>> outputs(const std::string& name);
  /// Every blob that something of a tenant's needs: inputs of jobs that have not ended, results, checkpoints.
  Result<std::set<Digest>> needed_blobs(const std::string& tenant);

  // Checkpoints: what is put or dropped returns the blobs that no checkpoint of the tenant names any more.

  /// In the place of an earlier one of that name; the job has got on: its lost and failed attempts count from 0 again.
  Result<std::vector<Digest>> put_checkpoint(const JobRecord& job, const CheckpointRecord& checkpoint);
  Result<std::vector<Digest>> drop_checkpoints(const JobRecord& job, const std::vector<std::string>& names);
  Result<std::vector<CheckpointRecord>> checkpoints(const JobRecord& job);

  /// Forgets jobs of a tenant that ended before a time, at most so many, oldest first; how many there were.
  Result<std::uint32_t> forget_ended(const std::string& tenant, std::int64_t before_unix_ms, std::uint32_t most);

 private:
  explicit JobStore(Database database);
  Result<JobRecord> read_job(const std::string& condition, const std::string& value);
  Result<JobRecord> read_row(Statement& row);
  Result<JobRecord> with_inputs(JobRecord job);
  Result<void> insert_event(std::int64_t job, const JobEvent& event);
  Result<std::vector<Digest>> drop_checkpoints_of_nobody(const JobRecord& ended);
  /// One of a bake's, or all.
  Result<std::vector<Digest>> delete_checkpoints(const JobRecord& job, const std::optional<std::string>& name);
  Result<void> insert_outputs(std::int64_t job, const std::vector<Digest>& outputs);

  Database database_;
  TaskPool thread_{1};  // the only one that touches database_
};

}  // namespace radbake::store
