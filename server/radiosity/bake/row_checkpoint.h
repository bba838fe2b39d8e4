#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/bake/checkpoints.h"
#include "server/radiosity/form_factor/patch_rows.h"

namespace radbake::radiosity {

/// A patch's row and what it does with light, as sampled.
struct TakenRow {
  FormFactorRow row;  ///< without entries where they are not kept
  PatchSample sample;
  std::uint32_t length = 0;
};

/// Rows of one replicate, in one piece. Entries [sum of the rows' lengths], row after row.
struct RowBlock {
  std::vector<std::uint32_t> patches;
  std::vector<TakenRow> rows;
  std::size_t num_refused = 0;  ///< rows with impossible values, left out
};
/// `fingerprint`: of all that the rows depend on.
std::string write_row_block(std::uint64_t fingerprint, const std::vector<std::uint32_t>& patches,
                            const std::vector<TakenRow>& rows);
/// Errors: kFailedPrecondition for another fingerprint or layout, kDataLoss for bytes that are no rows between
/// `num_patches`.
Result<RowBlock> read_row_block(std::string_view bytes, std::uint64_t fingerprint, std::size_t num_patches);

/// Keeps the rows of one replicate as they are sampled, and recalls those that an earlier attempt kept.
///
/// Each block waits for the checkpoints' interval, and twice as long after every eight: hours of rows lie in some
/// dozens of blocks, and what a crash costs is at most the interval or about an eighth of the time that the rows have
/// taken. Rows that there is no memory to keep are left out.
class RowCheckpoint {
 public:
  /// Reads what is kept under `prefix` into `rows` [patches]. checkpoints null: nothing is kept.
  RowCheckpoint(Checkpoints* checkpoints, std::string prefix, std::uint64_t fingerprint, std::vector<TakenRow>& rows);

  /// Whether a patch's row stands in `rows`, recalled or sampled. From any thread.
  bool is_known(std::uint32_t patch) const { return !state_.empty() && state_[patch].load() != kMissing; }
  /// A row stands in `rows`. From any thread, once a patch; keeps what has come since the last time, now and then.
  void add(std::uint32_t patch);

 private:
  using Clock = std::chrono::steady_clock;
  enum State : std::uint8_t { kMissing, kSampled, kKept };

  bool recall(const std::string& name);
  void save();
  void wait_for_next();

  Checkpoints* const checkpoints_;
  const std::string prefix_;
  const std::uint64_t fingerprint_;
  std::vector<TakenRow>& rows_;
  std::vector<std::atomic<std::uint8_t>> state_;  ///< [patches]; empty: nothing is kept
  std::uint64_t num_blocks_ = 0;
  std::uint64_t next_index_ = 0;  ///< above those of all blocks, where some are missing, too
  std::mutex mutex_;              // one saves at a time
  std::atomic<Clock::duration::rep> save_at_ = 0;
};

}  // namespace radbake::radiosity
