#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "server/store/sqlite.h"

namespace radbake::store {

/// Brings the job database up to date, step by step, each in one transaction; an empty file gets all tables.
/// Errors: kFailedPrecondition for a file that a newer radbaked has written.
Result<void> migrate(Database& database, const std::filesystem::path& file);

}  // namespace radbake::store
