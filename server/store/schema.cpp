#include "server/store/schema.h"

#include <iterator>
#include <string>

namespace radbake::store {
namespace {

// Step k brings a file of user_version k to k + 1. Steps are only ever appended.
const char* const kMigrations[] = {
    "CREATE TABLE jobs ("
    "  id INTEGER PRIMARY KEY AUTOINCREMENT,"
    "  name TEXT NOT NULL UNIQUE,"
    "  request_id TEXT NOT NULL UNIQUE,"
    "  body_sha256 TEXT NOT NULL,"
    "  label TEXT NOT NULL,"
    "  bake_key TEXT NOT NULL,"
    "  manifest_sha256 TEXT NOT NULL,"
    "  manifest_size INTEGER NOT NULL,"
    "  settings BLOB NOT NULL,"
    "  run BLOB NOT NULL,"
    "  state INTEGER NOT NULL,"
    "  attempt INTEGER NOT NULL,"
    "  lost_attempts INTEGER NOT NULL,"
    "  last_sequence INTEGER NOT NULL,"
    "  result BLOB NOT NULL,"
    "  error_code INTEGER NOT NULL,"  // -1: none
    "  error_message TEXT NOT NULL,"
    "  created_unix_ms INTEGER NOT NULL,"
    "  finished_unix_ms INTEGER NOT NULL);"
    "CREATE INDEX jobs_by_state ON jobs(state);"
    "CREATE INDEX jobs_by_bake_key ON jobs(bake_key);"
    "CREATE TABLE inputs ("
    "  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,"
    "  position INTEGER NOT NULL,"
    "  sha256 TEXT NOT NULL,"
    "  size INTEGER NOT NULL,"
    "  PRIMARY KEY (job, position)) WITHOUT ROWID;"
    "CREATE TABLE events ("
    "  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,"
    "  sequence INTEGER NOT NULL,"
    "  unix_ms INTEGER NOT NULL,"
    "  state INTEGER NOT NULL,"
    "  attempt INTEGER NOT NULL,"
    "  message TEXT NOT NULL,"
    "  PRIMARY KEY (job, sequence)) WITHOUT ROWID;",
    // Tenants, fair turns, results that are shared, attempts that go on.
    "ALTER TABLE jobs ADD COLUMN tenant TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE jobs ADD COLUMN client TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE jobs ADD COLUMN trace_id TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;"
    "ALTER TABLE jobs ADD COLUMN is_shared INTEGER NOT NULL DEFAULT 1;"
    "ALTER TABLE jobs ADD COLUMN is_whole INTEGER NOT NULL DEFAULT 0;"  // older results name no outputs
    "ALTER TABLE jobs ADD COLUMN is_from_store INTEGER NOT NULL DEFAULT 0;"
    "ALTER TABLE jobs ADD COLUMN failed_attempts INTEGER NOT NULL DEFAULT 0;"
    "CREATE TABLE outputs ("
    "  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,"
    "  sha256 TEXT NOT NULL,"
    "  size INTEGER NOT NULL,"
    "  PRIMARY KEY (job, sha256)) WITHOUT ROWID;"
    "CREATE TABLE checkpoints ("
    "  tenant TEXT NOT NULL,"
    "  bake_key TEXT NOT NULL,"
    "  name TEXT NOT NULL,"
    "  sha256 TEXT NOT NULL,"
    "  size INTEGER NOT NULL,"
    "  PRIMARY KEY (tenant, bake_key, name)) WITHOUT ROWID;",
};
constexpr std::int64_t kNewestVersion = std::size(kMigrations);

}  // namespace

Result<void> migrate(Database& database, const std::filesystem::path& file) {
  std::int64_t version = 0;
  {
    RADBAKE_ASSIGN_OR_RETURN(Statement query, database.prepare("PRAGMA user_version"));
    auto row = query.step();
    if (!row.ok()) return row.error();
    version = query.integer(0);
  }
  if (version > kNewestVersion) {
    return Error{ErrorCode::kFailedPrecondition, "the job database " + file.string() + " has version " +
                                                     std::to_string(version) + ", this radbaked knows " +
                                                     std::to_string(kNewestVersion) + ": use a newer radbaked"};
  }
  for (; version < kNewestVersion; ++version) {
    RADBAKE_RETURN_IF_ERROR(database.in_transaction([&]() -> Result<void> {
      RADBAKE_RETURN_IF_ERROR(database.execute(kMigrations[version]));
      return database.execute("PRAGMA user_version=" + std::to_string(version + 1));
    }));
  }
  return {};
}

}  // namespace radbake::store
