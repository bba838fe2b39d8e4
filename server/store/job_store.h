#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
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

  /// The job that a request created before. Errors: kAlreadyExists if its body was another.
  Result<std::optional<JobRecord>> find_request(const std::string& request_id, const std::string& body_sha256);

  /// Stores a job in state kQueued with its first event. Errors: kAlreadyExists for a known request_id.
  Result<JobRecord> create(const NewJob& job);

  /// Changes a job and appends the event of it, in one transaction. Errors: kNotFound.
  Result<RecordedChange> append_event(const std::string& name, const StateChange& change);

  /// Errors: kNotFound.
  Result<JobRecord> get(const std::string& name);
  Result<std::vector<JobEvent>> events_after(const std::string& name, std::uint64_t sequence);

  /// Newest first, without results and inputs; before_id 0: from the newest on.
  Result<std::vector<JobRecord>> list(std::uint32_t num_jobs, std::int64_t before_id);
  /// Every job that has not ended, oldest first.
  Result<std::vector<JobRecord>> unfinished();

 private:
  explicit JobStore(Database database);
  Result<JobRecord> read_job(const std::string& condition, const std::string& value);
  Result<JobRecord> read_row(Statement& row);
  Result<JobRecord> with_inputs(JobRecord job);
  Result<void> insert_event(std::int64_t job, const JobEvent& event);

  Database database_;
  TaskPool thread_{1};  // the only one that touches database_
};

}  // namespace radbake::store
