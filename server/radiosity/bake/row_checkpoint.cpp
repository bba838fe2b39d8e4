#include "server/radiosity/bake/row_checkpoint.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/archive.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint64_t kRowsFormat = 0x3130776f72646172;  // "radrow01"

/// What of a row is no entry.
struct KeptRow {
  std::uint32_t patch = 0, num_entries = 0, length = 0;
  double counted = 0, escaped = 0, absorbed = 0;
  std::uint64_t traced = 0;
  double clipped = 0, stated_error = 0;
  PatchSample sample;
};

Error no_rows(const std::string& why) { return {ErrorCode::kDataLoss, "the kept rows cannot be read: " + why}; }

bool is_sound(const KeptRow& row) {
  const double numbers[] = {row.counted,
                            row.escaped,
                            row.absorbed,
                            row.clipped,
                            row.stated_error,
                            row.sample.visible_share,
                            row.sample.opaque_share,
                            row.sample.direct_variance,
                            min_component(row.sample.reflectance),
                            min_component(row.sample.diffuse_transmittance),
                            min_component(row.sample.glow),
                            min_component(row.sample.direct)};
  return std::all_of(std::begin(numbers), std::end(numbers), [](double x) { return std::isfinite(x) && x >= 0; }) &&
         is_finite(row.sample.reflectance) && is_finite(row.sample.diffuse_transmittance) &&
         is_finite(row.sample.glow) && is_finite(row.sample.direct) && max_component(row.sample.reflectance) < 1;
}

bool is_sound(const std::vector<FormFactorRow::Entry>& entries, std::size_t num_patches) {
  for (std::size_t k = 0; k < entries.size(); ++k) {
    if (entries[k].patch >= num_patches || !(entries[k].weight > 0) || !std::isfinite(entries[k].weight)) return false;
    if (k > 0 && entries[k].patch <= entries[k - 1].patch) return false;
  }
  return true;
}

}  // namespace

std::string write_row_block(std::uint64_t fingerprint, const std::vector<std::uint32_t>& patches,
                            const std::vector<TakenRow>& rows) {
  ArchiveWriter archive;
  archive(kRowsFormat);
  archive(fingerprint);
  std::vector<KeptRow> kept;
  kept.reserve(patches.size());
  std::vector<FormFactorRow::Entry> entries;
  for (const std::uint32_t patch : patches) {
    const auto& [row, sample, length] = rows[patch];
    kept.push_back({patch, static_cast<std::uint32_t>(row.entries.size()), length, row.counted, row.escaped,
                    row.absorbed, row.traced, row.clipped, row.stated_error, sample});
    entries.insert(entries.end(), row.entries.begin(), row.entries.end());
  }
  archive(kept);
  archive(entries);
  return archive.take();
}

Result<RowBlock> read_row_block(std::string_view bytes, std::uint64_t fingerprint, std::size_t num_patches) {
  ArchiveReader archive(bytes);
  std::uint64_t format = 0, theirs = 0;
  archive(format);
  archive(theirs);
  if (format != kRowsFormat) return no_rows("they are none");
  if (theirs != fingerprint) return Error{ErrorCode::kFailedPrecondition, "the kept rows are of another system"};
  std::vector<KeptRow> kept;
  std::vector<FormFactorRow::Entry> entries;
  archive(kept);
  archive(entries);
  if (!archive.is_at_end()) return no_rows("they do not end where they should");

  RowBlock block;
  std::size_t at = 0;
  for (const KeptRow& own : kept) {
    if (own.patch >= num_patches) return no_rows("there is no patch " + std::to_string(own.patch));
    if (own.num_entries > entries.size() - at) return no_rows("they have too few entries");
    if (!is_sound(own)) return no_rows("patch " + std::to_string(own.patch) + " has an impossible value");
    TakenRow taken;
    taken.row = {{entries.begin() + static_cast<std::ptrdiff_t>(at),
                  entries.begin() + static_cast<std::ptrdiff_t>(at + own.num_entries)},
                 own.counted,
                 own.escaped,
                 own.absorbed,
                 own.traced,
                 own.clipped,
                 own.stated_error};
    if (!is_sound(taken.row.entries, num_patches)) {
      return no_rows("the row of patch " + std::to_string(own.patch) + " has an impossible entry");
    }
    at += own.num_entries;
    taken.sample = own.sample;
    taken.length = own.length;
    block.patches.push_back(own.patch);
    block.rows.push_back(std::move(taken));
  }
  if (at != entries.size()) return no_rows("they have too many entries");
  return block;
}

RowCheckpoint::RowCheckpoint(Checkpoints* checkpoints, std::string prefix, std::uint64_t fingerprint,
                             std::vector<TakenRow>& rows)
    : checkpoints_(checkpoints), prefix_(std::move(prefix)), fingerprint_(fingerprint), rows_(rows) {
  if (checkpoints_ == nullptr) return;
  state_ = std::vector<std::atomic<std::uint8_t>>(rows.size());
  save_at_ = (Clock::now() +
              std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(checkpoints_->interval())))
                 .time_since_epoch()
                 .count();
  for (const std::string& name : checkpoints_->names()) {
    if (!name.starts_with(prefix_)) continue;
    ++num_blocks_;
    const auto bytes = checkpoints_->load(name);
    if (!bytes) continue;
    // Rows of another system, or broken ones, are sampled again.
    Result<RowBlock> block = read_row_block(*bytes, fingerprint_, rows.size());
    if (!block.ok()) continue;
    for (std::size_t k = 0; k < block->rows.size(); ++k) {
      rows_[block->patches[k]] = std::move(block->rows[k]);
      state_[block->patches[k]] = kKept;
    }
  }
}

void RowCheckpoint::add(std::uint32_t patch) {
  if (state_.empty() || state_[patch].load() == kKept) return;
  state_[patch].store(kSampled);
  if (Clock::now().time_since_epoch().count() < save_at_.load(std::memory_order_relaxed)) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock.owns_lock() && Clock::now().time_since_epoch().count() >= save_at_.load()) save();
}

void RowCheckpoint::save() {
  std::vector<std::uint32_t> patches;
  for (std::uint32_t patch = 0; patch < state_.size(); ++patch) {
    if (state_[patch].load() != kSampled) continue;
    state_[patch].store(kKept);
    patches.push_back(patch);
  }
  checkpoints_->save(prefix_ + std::to_string(num_blocks_++), write_row_block(fingerprint_, patches, rows_));
  save_at_ = (Clock::now() +
              std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(checkpoints_->interval())))
                 .time_since_epoch()
                 .count();
}

}  // namespace radbake::radiosity
