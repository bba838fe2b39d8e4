#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "server/store/failpoint.h"

namespace radbake::store {

/// A prepared statement. Values are bound from index 1 on and columns read from index 0 on, as in SQLite.
class Statement {
 public:
  Statement& bind(int index, std::int64_t value);
  Statement& bind_text(int index, const std::string& value);
  Statement& bind_bytes(int index, const std::string& value);

  /// Goes to the next row: true if there is one.
  Result<bool> step();
  /// For statements without rows.
  Result<void> execute();

  std::int64_t integer(int column) const;
  std::string bytes(int column) const;

 private:
  friend class Database;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  Statement(sqlite3* database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// An SQLite file, opened so that what is committed survives a power loss (WAL, synchronous=FULL). One thread only.
class Database {
 public:
  static Result<Database> open(const std::filesystem::path& file);

  /// Runs statements without values or rows.
  Result<void> execute(const std::string& sql);
  Result<Statement> prepare(const std::string& sql);
  /// Rows that the last statement changed.
  int num_changed() const { return sqlite3_changes(database_.get()); }
  std::int64_t last_insert_id() const { return sqlite3_last_insert_rowid(database_.get()); }

  /// Runs `body` in one transaction: all of it, or on an error nothing.
  template <typename Body>
  Result<void> in_transaction(Body body) {
    RADBAKE_RETURN_IF_ERROR(execute("BEGIN IMMEDIATE"));
    Result<void> done = body();
    failpoint("database.changed");
    if (fault("commit") != 0) done = Error{ErrorCode::kResourceExhausted, "job database: database or disk is full"};
    if (done.ok()) done = execute("COMMIT");
    failpoint("database.committed");
    if (!done.ok()) (void)execute("ROLLBACK").ok();
    return done;
  }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
  };
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace radbake::store
