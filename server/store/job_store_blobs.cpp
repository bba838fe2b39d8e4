#include <utility>

#include "server/store/job_store.h"

namespace radbake::store {
namespace {

constexpr int kSucceeded = static_cast<int>(JobState::kSucceeded);

/// Jobs that are not shared leave each other's alone.
std::string checkpoint_key(const JobRecord& job) {
  return job.owner.is_shared ? job.bake_key : job.bake_key + '/' + job.name;
}

/// The digests of all rows: columns sha256, size.
template <typename Digests>
Result<void> read_digests(Statement& rows, Digests& digests) {
  while (true) {
    RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
    if (!has_row) return {};
    digests.insert(digests.end(), Digest{rows.bytes(0), static_cast<std::uint64_t>(rows.integer(1))});
  }
}

}  // namespace

Result<void> JobStore::insert_outputs(std::int64_t job, const std::vector<Digest>& outputs) {
  for (const Digest& output : outputs) {
    RADBAKE_ASSIGN_OR_RETURN(Statement insert, database_.prepare("INSERT OR IGNORE INTO outputs VALUES (?, ?, ?)"));
    insert.bind(1, job).bind_text(2, output.sha256).bind(3, static_cast<std::int64_t>(output.size_bytes));
    RADBAKE_RETURN_IF_ERROR(insert.execute());
  }
  return {};
}

Result<std::optional<JobRecord>> JobStore::find_result(const std::string& tenant, const std::string& bake_key) {
  return thread_.run([&]() -> Result<std::optional<JobRecord>> {
    std::string name;
    {
      RADBAKE_ASSIGN_OR_RETURN(Statement row,
                               database_.prepare("SELECT name FROM jobs WHERE bake_key=? AND tenant=? AND state=? AND "
                                                 "is_whole=1 AND is_shared=1 ORDER BY id DESC LIMIT 1"));
      row.bind_text(1, bake_key).bind_text(2, tenant).bind(3, kSucceeded);
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, row.step());
      if (!has_row) return std::optional<JobRecord>();
      name = row.bytes(0);
    }
    RADBAKE_ASSIGN_OR_RETURN(JobRecord job, read_job("name=?", name));
    return std::optional<JobRecord>(std::move(job));
  });
}

Result<std::vector<Digest>> JobStore::outputs(const std::string& name) {
  return thread_.run([&]() -> Result<std::vector<Digest>> {
    RADBAKE_ASSIGN_OR_RETURN(
        Statement rows,
        database_.prepare("SELECT sha256, size FROM outputs JOIN jobs ON jobs.id=outputs.job WHERE name=?"));
    rows.bind_text(1, name);
    std::vector<Digest> digests;
    RADBAKE_RETURN_IF_ERROR(read_digests(rows, digests));
    return digests;
  });
}

Result<std::set<Digest>> JobStore::needed_blobs(const std::string& tenant) {
  return thread_.run([&]() -> Result<std::set<Digest>> {
    RADBAKE_ASSIGN_OR_RETURN(
        Statement rows,
        database_.prepare("SELECT sha256, size FROM inputs JOIN jobs ON jobs.id=inputs.job WHERE tenant=?1 AND "
                          "state<?2 UNION SELECT sha256, size FROM outputs JOIN jobs ON jobs.id=outputs.job WHERE "
                          "tenant=?1 UNION SELECT sha256, size FROM checkpoints WHERE tenant=?1"));
    rows.bind_text(1, tenant).bind(2, kSucceeded);
    std::set<Digest> digests;
    RADBAKE_RETURN_IF_ERROR(read_digests(rows, digests));
    return digests;
  });
}

Result<std::vector<Digest>> JobStore::delete_checkpoints(const JobRecord& job, const std::optional<std::string>& name) {
  std::vector<Digest> unneeded;
  const auto bind = [&](Statement& statement) {
    statement.bind_text(1, job.owner.tenant).bind_text(2, checkpoint_key(job));
    if (name) statement.bind_text(3, *name);  // else it is null
  };
  {
    // Equal bakes that leave each other alone may have left equal blobs.
    RADBAKE_ASSIGN_OR_RETURN(
        Statement rows,
        database_.prepare(
            "SELECT DISTINCT sha256, size FROM checkpoints WHERE tenant=?1 AND bake_key=?2 AND (?3 IS NULL "
            "OR name=?3) AND sha256 NOT IN (SELECT sha256 FROM checkpoints WHERE tenant=?1 AND NOT "
            "(bake_key=?2 AND (?3 IS NULL OR name=?3)))"));
    bind(rows);
    RADBAKE_RETURN_IF_ERROR(read_digests(rows, unneeded));
  }
  RADBAKE_ASSIGN_OR_RETURN(
      Statement drop,
      database_.prepare("DELETE FROM checkpoints WHERE tenant=?1 AND bake_key=?2 AND (?3 IS NULL OR name=?3)"));
  bind(drop);
  RADBAKE_RETURN_IF_ERROR(drop.execute());
  return unneeded;
}

Result<std::vector<Digest>> JobStore::put_checkpoint(const JobRecord& job, const CheckpointRecord& checkpoint) {
  return thread_.run([&]() -> Result<std::vector<Digest>> {
    std::vector<Digest> unneeded;
    RADBAKE_RETURN_IF_ERROR(database_.in_transaction([&]() -> Result<void> {
      RADBAKE_ASSIGN_OR_RETURN(unneeded, delete_checkpoints(job, checkpoint.name));
      std::erase(unneeded, checkpoint.digest);
      RADBAKE_ASSIGN_OR_RETURN(Statement put, database_.prepare("INSERT INTO checkpoints VALUES (?, ?, ?, ?, ?)"));
      put.bind_text(1, job.owner.tenant).bind_text(2, checkpoint_key(job)).bind_text(3, checkpoint.name);
      put.bind_text(4, checkpoint.digest.sha256).bind(5, static_cast<std::int64_t>(checkpoint.digest.size_bytes));
      RADBAKE_RETURN_IF_ERROR(put.execute());
      RADBAKE_ASSIGN_OR_RETURN(Statement reset,
                               database_.prepare("UPDATE jobs SET lost_attempts=0, failed_attempts=0 WHERE id=?"));
      reset.bind(1, job.id);
      return reset.execute();
    }));
    return unneeded;
  });
}

Result<std::vector<Digest>> JobStore::drop_checkpoints(const JobRecord& job, const std::vector<std::string>& names) {
  return thread_.run([&]() -> Result<std::vector<Digest>> {
    std::vector<Digest> unneeded;
    RADBAKE_RETURN_IF_ERROR(database_.in_transaction([&]() -> Result<void> {
      for (const std::string& name : names) {
        RADBAKE_ASSIGN_OR_RETURN(const std::vector<Digest> more, delete_checkpoints(job, name));
        unneeded.insert(unneeded.end(), more.begin(), more.end());
      }
      return {};
    }));
    return unneeded;
  });
}

Result<std::vector<Digest>> JobStore::drop_checkpoints_of_nobody(const JobRecord& ended) {
  RADBAKE_ASSIGN_OR_RETURN(Statement others, database_.prepare("SELECT 1 FROM jobs WHERE bake_key=? AND tenant=? AND "
                                                               "is_shared=1 AND state<? LIMIT 1"));
  others.bind_text(1, checkpoint_key(ended)).bind_text(2, ended.owner.tenant).bind(3, kSucceeded);
  RADBAKE_ASSIGN_OR_RETURN(const bool has_others, others.step());
  if (has_others) return std::vector<Digest>();
  return delete_checkpoints(ended, std::nullopt);
}

Result<std::vector<CheckpointRecord>> JobStore::checkpoints(const JobRecord& job) {
  return thread_.run([&]() -> Result<std::vector<CheckpointRecord>> {
    RADBAKE_ASSIGN_OR_RETURN(Statement rows, database_.prepare("SELECT name, sha256, size FROM checkpoints WHERE "
                                                               "tenant=? AND bake_key=? ORDER BY name"));
    rows.bind_text(1, job.owner.tenant).bind_text(2, checkpoint_key(job));
    std::vector<CheckpointRecord> checkpoints;
    while (true) {
      RADBAKE_ASSIGN_OR_RETURN(const bool has_row, rows.step());
      if (!has_row) return checkpoints;
      checkpoints.push_back({rows.bytes(0), {rows.bytes(1), static_cast<std::uint64_t>(rows.integer(2))}});
    }
  });
}

Result<std::uint32_t> JobStore::forget_ended(const std::string& tenant, std::int64_t before_unix_ms,
                                             std::uint32_t most) {
  return thread_.run([&]() -> Result<std::uint32_t> {
    RADBAKE_ASSIGN_OR_RETURN(
        Statement forget,
        database_.prepare("DELETE FROM jobs WHERE id IN (SELECT id FROM jobs WHERE tenant=? AND state>=? AND "
                          "finished_unix_ms<? ORDER BY finished_unix_ms, id LIMIT ?)"));
    forget.bind_text(1, tenant).bind(2, kSucceeded).bind(3, before_unix_ms).bind(4, most);
    RADBAKE_RETURN_IF_ERROR(forget.execute());
    return static_cast<std::uint32_t>(database_.num_changed());
  });
}

}  // namespace radbake::store
