#include "server/store/job_store.h"

#include <sys/random.h>

#include <utility>

#include "common/base/check.h"
#include "common/base/unix_time.h"
#include "server/store/schema.h"

namespace radbake::store {
namespace {

// The numbers of error codes are on disk.
static_assert(static_cast<int>(ErrorCode::kInvalidArgument) == 0 && static_cast<int>(ErrorCode::kInternal) == 8);

const char* const kColumns =
    "id, name, label, bake_key, manifest_sha256, manifest_size, settings, run, state, attempt, lost_attempts, "
    "last_sequence, error_code, error_message, created_unix_ms, finished_unix_ms, tenant, client, trace_id, priority, "
    "is_shared, is_from_store, failed_attempts, ";

// Tenants choose their request ids by themselves: equal ones do not meet. No tenant's name has a line's end.
std::string scoped(const std::string& tenant, const std::string& request_id) {
  return tenant.empty() ? request_id : tenant + '\n' + request_id;
}

// Random, so that a name does not tell how many jobs there are, nor comes back after the data folder was emptied.
std::string new_name() {
  unsigned char random[8];
  RADBAKE_CHECK_EQ(getrandom(random, sizeof(random), 0), static_cast<ssize_t>(sizeof(random)));
  constexpr char kDigits[] = "0123456789abcdef";
  std::string name = "bakes/";
  for (const unsigned char byte : random) {
    name.push_back(kDigits[byte >> 4]);
    name.push_back(kDigits[byte & 15]);
  }
  return name;
}

}  // namespace

const char* job_state_name(JobState state) {
  switch (state) {
    case JobState::kQueued: return "queued";
    case JobState::kPreparing: return "preparing";
    case JobState::kFormFactors: return "form factors";
    case JobState::kSolving: return "solving";
    case JobState::kGathering: return "gathering";
    case JobState::kWriting: return "writing";
    case JobState::kSucceeded: return "succeeded";
    case JobState::kFailed: return "failed";
    case JobState::kCancelled: return "cancelled";
  }
  return "unknown";
}

Result<std::unique_ptr<JobStore>> JobStore::open(const std::filesystem::path& file) {
  RADBAKE_ASSIGN_OR_RETURN(Database database, Database::open(file));
  RADBAKE_RETURN_IF_ERROR(migrate(database, file));
  return std::unique_ptr<JobStore>(new JobStore(std::move(database)));
}

JobStore::JobStore(Database database) : database_(std::move(database)) {}
JobStore::~JobStore() = default;

Result<JobRecord> JobStore::read_row(Statement& row) {
  JobRecord job;
  job.id = row.integer(0);
  job.name = row.bytes(1);
  job.label = row.bytes(2);
  job.bake_key = row.bytes(3);
  job.work.manifest = {row.bytes(4), static_cast<std::uint64_t>(row.integer(5))};
  job.work.settings = row.bytes(6);
  job.work.run = row.bytes(7);
  job.state = static_cast<JobState>(row.integer(8));
  job.attempt = static_cast<std::uint32_t>(row.integer(9));
  job.lost_attempts = static_cast<std::uint32_t>(row.integer(10));
  job.last_sequence = static_cast<std::uint64_t>(row.integer(11));
  if (row.integer(12) >= 0) job.error = Error{static_cast<ErrorCode>(row.integer(12)), row.bytes(13)};
  job.created_unix_ms = row.integer(14);
  job.finished_unix_ms = row.integer(15);
  job.owner = {row.bytes(16), row.bytes(17), row.bytes(18), static_cast<int>(row.integer(19)), row.integer(20) != 0};
  job.is_from_store = row.integer(21) != 0;
  job.failed_attempts = static_cast<std::uint32_t>(row.integer(22));
  job.result = row.bytes(23);
  return job;
}

Result<JobRecord> JobStore::with_inputs(JobRecord job) {
  RADBAKE_ASSIGN_OR_RETURN(Statement inputs,
                           database_.prepare("SELECT sha256, size FROM inputs WHERE job=? ORDER BY position"));
  inputs.bind(1, job.id);
  while (true) {
    RADBAKE_ASSIGN_OR_RETURN(const bool has_row, inputs.step());
    if (!has_row) return job;
    job.work.inputs.push_back({inputs.bytes(0), static_cast<std::uint64_t>(inputs.integer(1))});
  }
}

Result<JobRecord> JobStore::read_job(const std::string& condition, const std::string& value) {
  RADBAKE_ASSIGN_OR_RETURN(
      Statement row, database_.prepare(std::string("SELECT ") + kColumns + "result FROM jobs WHERE " + condition));
  row.bind_text(1, value);
  RADBAKE_ASSIGN_OR_RETURN(const bool has_row, row.step());
  if (!has_row) return Error{ErrorCode::kNotFound, "there is no bake '" + value.substr(0, 200) + "'"};
  RADBAKE_ASSIGN_OR_RETURN(JobRecord job, read_row(row));
  return with_inputs(std::move(job));
}

Result<void> JobStore::insert_event(std::int64_t job, const JobEvent& event) {
  RADBAKE_ASSIGN_OR_RETURN(Statement insert, database_.prepare("INSERT INTO events VALUES (?, ?, ?, ?, ?, ?)"));
  insert.bind(1, job).bind(2, static_cast<std::int64_t>(event.sequence)).bind(3, event.unix_ms);
  insert.bind(4, static_cast<int>(event.state)).bind(5, event.attempt).bind_text(6, event.message);
  return insert.execute();
}

Result<std::optional<JobRecord>> JobStore::find_request(const std::string& tenant, const std::string& request_id,
                                                        const std::string& body_sha256) {
  return thread_.run([&]() -> Result<std::optional<JobRecord>> {
    std::string name;
    {
      RADBAKE_ASSIGN_OR_RETURN(Statement row,
                               database_.prepare("SELECT name, body_sha256 FROM jobs WHERE request_id=?"));
      row.bind_text(1, scoped(tenant, request_id));
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, row.step());
      if (!has_row) return std::optional<JobRecord>();
      name = row.bytes(0);
      if (row.bytes(1) != body_sha256) {
        return Error{ErrorCode::kAlreadyExists,
                     "request_id '" + request_id + "' was used for " + name + " with other settings or another scene"};
      }
    }
    RADBAKE_ASSIGN_OR_RETURN(JobRecord job, read_job("name=?", name));
    return std::optional<JobRecord>(std::move(job));
  });
}

Result<JobRecord> JobStore::create(const NewJob& job, const JobRecord* stored) {
  return thread_.run([&]() -> Result<JobRecord> {
    const std::string name = new_name(), request = scoped(job.owner.tenant, job.request_id);
    const JobState state = stored ? JobState::kSucceeded : JobState::kQueued;
    RADBAKE_RETURN_IF_ERROR(database_.in_transaction([&]() -> Result<void> {
      {
        RADBAKE_ASSIGN_OR_RETURN(Statement known, database_.prepare("SELECT name FROM jobs WHERE request_id=?"));
        known.bind_text(1, request);
        RADBAKE_ASSIGN_OR_RETURN(const bool is_known, known.step());
        if (is_known) {
          return Error{ErrorCode::kAlreadyExists, "request_id '" + job.request_id + "' was used for " + known.bytes(0)};
        }
      }
      const std::int64_t now = unix_ms_now();
      RADBAKE_ASSIGN_OR_RETURN(
          Statement insert,
          database_.prepare("INSERT INTO jobs (name, request_id, body_sha256, label, bake_key, manifest_sha256, "
                            "manifest_size, settings, run, state, attempt, lost_attempts, last_sequence, result, "
                            "error_code, error_message, created_unix_ms, finished_unix_ms, tenant, trace_id, "
                            "priority, is_shared, is_whole, is_from_store, client) "
                            "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, 1, 0, ?12, ?13, -1, '', ?11, ?14, ?15, "
                            "?16, ?17, ?18, ?19, ?19, ?20)"));
      insert.bind_text(1, name).bind_text(2, request).bind_text(3, job.body_sha256).bind_text(4, job.label);
      insert.bind_text(5, job.bake_key).bind_text(6, job.work.manifest.sha256);
      insert.bind(7, static_cast<std::int64_t>(job.work.manifest.size_bytes)).bind_bytes(8, job.work.settings);
      insert.bind_bytes(9, job.work.run).bind(10, static_cast<int>(state)).bind(11, now).bind(12, stored ? 2 : 1);
      insert.bind_bytes(13, stored ? stored->result : "").bind(14, stored ? now : 0).bind_text(15, job.owner.tenant);
      insert.bind_text(16, job.owner.trace_id).bind(17, job.owner.priority).bind(18, job.owner.is_shared ? 1 : 0);
      insert.bind(19, stored ? 1 : 0).bind_text(20, job.owner.client);
      RADBAKE_RETURN_IF_ERROR(insert.execute());
      const std::int64_t id = database_.last_insert_id();
      for (std::size_t i = 0; i < job.work.inputs.size(); ++i) {
        RADBAKE_ASSIGN_OR_RETURN(Statement input, database_.prepare("INSERT INTO inputs VALUES (?, ?, ?, ?)"));
        input.bind(1, id).bind(2, static_cast<std::int64_t>(i)).bind_text(3, job.work.inputs[i].sha256);
        input.bind(4, static_cast<std::int64_t>(job.work.inputs[i].size_bytes));
        RADBAKE_RETURN_IF_ERROR(input.execute());
      }
      RADBAKE_RETURN_IF_ERROR(insert_event(id, {1, now, JobState::kQueued, 1, "queued"}));
      if (!stored) return {};
      RADBAKE_RETURN_IF_ERROR(insert_event(id, {2, now, state, 1, "the result of " + stored->name}));
      RADBAKE_ASSIGN_OR_RETURN(
          Statement outputs, database_.prepare("INSERT INTO outputs SELECT ?, sha256, size FROM outputs WHERE job=?"));
      outputs.bind(1, id).bind(2, stored->id);
      return outputs.execute();
    }));
    return read_job("name=?", name);
  });
}

Result<RecordedChange> JobStore::append_event(const std::string& name, const StateChange& change) {
  return thread_.run([&]() -> Result<RecordedChange> {
    RecordedChange recorded;
    RADBAKE_RETURN_IF_ERROR(database_.in_transaction([&]() -> Result<void> {
      RADBAKE_ASSIGN_OR_RETURN(const JobRecord job, read_job("name=?", name));
      const std::uint32_t attempt = change.attempt.value_or(job.attempt);
      recorded.event = {job.last_sequence + 1, unix_ms_now(), change.state, attempt, change.message};
      RADBAKE_ASSIGN_OR_RETURN(
          Statement update,
          database_.prepare("UPDATE jobs SET state=?, attempt=?, lost_attempts=?, last_sequence=?, result=?, "
                            "error_code=?, error_message=?, finished_unix_ms=?, is_whole=?, failed_attempts=? "
                            "WHERE id=?"));
      update.bind(1, static_cast<int>(change.state)).bind(2, attempt);
      update.bind(3, change.lost_attempts.value_or(job.lost_attempts));
      update.bind(4, static_cast<std::int64_t>(recorded.event.sequence)).bind_bytes(5, change.result);
      update.bind(6, change.error ? static_cast<int>(change.error->code) : -1);
      update.bind_text(7, change.error ? change.error->message : "");
      update.bind(8, is_terminal(change.state) ? recorded.event.unix_ms : 0);
      update.bind(9, change.state == JobState::kSucceeded && change.is_whole ? 1 : 0);
      update.bind(10, change.failed_attempts.value_or(job.failed_attempts)).bind(11, job.id);
      RADBAKE_RETURN_IF_ERROR(update.execute());
      RADBAKE_RETURN_IF_ERROR(insert_event(job.id, recorded.event));
      RADBAKE_RETURN_IF_ERROR(insert_outputs(job.id, change.outputs));
      if (is_terminal(change.state)) {
        RADBAKE_ASSIGN_OR_RETURN(recorded.unneeded, drop_checkpoints_of_nobody(job));
      }
      RADBAKE_ASSIGN_OR_RETURN(recorded.record, read_job("name=?", name));
      return {};
    }));
    return recorded;
  });
}

Result<JobRecord> JobStore::get(const std::string& name) {
  return thread_.run([&] { return read_job("name=?", name); });
}

Result<std::vector<JobEvent>> JobStore::events_after(const std::string& name, std::uint64_t sequence) {
  return thread_.run([&]() -> Result<std::vector<JobEvent>> {
    RADBAKE_ASSIGN_OR_RETURN(
        Statement rows, database_.prepare("SELECT sequence, unix_ms, events.state, events.attempt, message FROM events "
                                          "JOIN jobs ON jobs.id=events.job WHERE name=? AND sequence>? "
                                          "ORDER BY sequence"));
    rows.bind_text(1, name).bind(2, static_cast<std::int64_t>(sequence));
    std::vector<JobEvent> events;
    while (true) {
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
      if (!has_row) return events;
      events.push_back({static_cast<std::uint64_t>(rows.integer(0)), rows.integer(1),
                        static_cast<JobState>(rows.integer(2)), static_cast<std::uint32_t>(rows.integer(3)),
                        rows.bytes(4)});
    }
  });
}

Result<std::vector<JobRecord>> JobStore::list(const std::optional<std::string>& tenant, std::uint32_t num_jobs,
                                              std::int64_t before_id) {
  return thread_.run([&]() -> Result<std::vector<JobRecord>> {
    RADBAKE_ASSIGN_OR_RETURN(Statement rows,
                             database_.prepare(std::string("SELECT ") + kColumns +
                                               "x'' FROM jobs WHERE (?1=0 OR id<?1) AND (?3=0 OR tenant=?4) "
                                               "ORDER BY id DESC LIMIT ?2"));
    rows.bind(1, before_id).bind(2, num_jobs).bind(3, tenant ? 1 : 0).bind_text(4, tenant.value_or(""));
    std::vector<JobRecord> jobs;
    while (true) {
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
      if (!has_row) return jobs;
      RADBAKE_ASSIGN_OR_RETURN(JobRecord job, read_row(rows));
      jobs.push_back(std::move(job));
    }
  });
}

Result<std::vector<JobStore::ClientCount>> JobStore::ended_by_client(std::int64_t since_unix_ms) {
  return thread_.run([&]() -> Result<std::vector<ClientCount>> {
    RADBAKE_ASSIGN_OR_RETURN(Statement rows,
                             database_.prepare("SELECT tenant, client, COUNT(*) FROM jobs WHERE state>=? AND "
                                               "finished_unix_ms>=? AND is_from_store=0 GROUP BY tenant, client"));
    rows.bind(1, static_cast<int>(JobState::kSucceeded)).bind(2, since_unix_ms);
    std::vector<ClientCount> counts;
    while (true) {
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
      if (!has_row) return counts;
      counts.push_back({rows.bytes(0), rows.bytes(1), static_cast<std::uint64_t>(rows.integer(2))});
    }
  });
}

Result<std::vector<JobRecord>> JobStore::unfinished() {
  return thread_.run([&]() -> Result<std::vector<JobRecord>> {
    RADBAKE_ASSIGN_OR_RETURN(Statement rows, database_.prepare(std::string("SELECT ") + kColumns +
                                                               "result FROM jobs WHERE state<? ORDER BY id"));
    rows.bind(1, static_cast<int>(JobState::kSucceeded));
    std::vector<JobRecord> jobs;
    while (true) {
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
      if (!has_row) return jobs;
      RADBAKE_ASSIGN_OR_RETURN(JobRecord job, read_row(rows));
      RADBAKE_ASSIGN_OR_RETURN(job, with_inputs(std::move(job)));
      jobs.push_back(std::move(job));
    }
  });
}

}  // namespace radbake::store
