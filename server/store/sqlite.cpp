#include "server/store/sqlite.h"

#include "common/base/check.h"

namespace radbake::store {
namespace {

constexpr int kBusyTimeoutMs = 5000;

Error error_of(sqlite3* database) {
  const int code = sqlite3_errcode(database);
  return {code == SQLITE_FULL ? ErrorCode::kResourceExhausted : ErrorCode::kInternal,
          std::string("job database: ") + sqlite3_errmsg(database)};
}

}  // namespace

Statement& Statement::bind(int index, std::int64_t value) {
  RADBAKE_CHECK_EQ(sqlite3_bind_int64(statement_.get(), index, value), SQLITE_OK);
  return *this;
}

Statement& Statement::bind_text(int index, const std::string& value) {
  RADBAKE_CHECK_EQ(
      sqlite3_bind_text64(statement_.get(), index, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8),
      SQLITE_OK);
  return *this;
}

Statement& Statement::bind_bytes(int index, const std::string& value) {
  RADBAKE_CHECK_EQ(sqlite3_bind_blob64(statement_.get(), index, value.data(), value.size(), SQLITE_TRANSIENT),
                   SQLITE_OK);
  return *this;
}

Result<bool> Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return error_of(database_);
}

Result<void> Statement::execute() {
  auto stepped = step();
  if (!stepped.ok()) return stepped.error();
  return {};
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

std::string Statement::bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return size == 0 ? std::string() : std::string(static_cast<const char*>(data), size);
}

Result<Database> Database::open(const std::filesystem::path& file) {
  Database database;
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  database.database_.reset(raw);
  if (code != SQLITE_OK)
    return internal_error("cannot open the job database " + file.string() + ": " + sqlite3_errstr(code));
  sqlite3_busy_timeout(raw, kBusyTimeoutMs);
  RADBAKE_RETURN_IF_ERROR(database.execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON"));
  return database;
}

Result<void> Database::execute(const std::string& sql) {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    return error_of(database_.get());
  return {};
}

Result<Statement> Database::prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), static_cast<int>(sql.size()), &statement, nullptr) !=
      SQLITE_OK) {
    return error_of(database_.get());
  }
  return Statement(database_.get(), statement);
}

}  // namespace radbake::store
