#include "server/radiosity/bake/row_checkpoint.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <new>
#include <utility>

#include "common/base/archive.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint64_t kRowsFormat = 0x3130776f72646172;  // "radrow01"

/// After so many blocks, the next ones wait twice as long.
constexpr std::uint64_t kBlocksPerDoubling = 8;
constexpr double kLongestWait = 1e6;  // seconds, that a clock can add
/// Of the scene checks, which take reflectance and transmittance that add up to so much more than one; and of sums of
/// exchanges, which may lie as much below zero.
constexpr double kRounding = 1e-6;

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
                            row.absorbed + kRounding * row.counted,
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
         is_finite(row.sample.glow) && is_finite(row.sample.direct) &&
         max_component(row.sample.reflectance) <= 1 + kRounding;
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
  std::size_t num_entries = 0;
  for (const std::uint32_t patch : patches) num_entries += rows[patch].row.entries.size();
  std::vector<KeptRow> kept;
  kept.reserve(patches.size());
  std::vector<FormFactorRow::Entry> entries;
  entries.reserve(num_entries);
  for (const std::uint32_t patch : patches) {
    const auto& [row, sample, length] = rows[patch];
    kept.push_back({patch, static_cast<std::uint32_t>(row.entries.size()), length, row.counted, row.escaped,
                    row.absorbed, row.traced, row.clipped, row.stated_error, sample});
    entries.insert(entries.end(), row.entries.begin(), row.entries.end());
  }
  const auto archive_to = [&](auto& archive) {
    archive(kRowsFormat);
    archive(fingerprint);
    archive(kept);
    archive(entries);
  };
  ArchiveSize size;
  archive_to(size);
  ArchiveWriter archive(size.bytes());
  archive_to(archive);
  return archive.take();
}

Result<RowBlock> read_row_block(std::string_view bytes, std::uint64_t fingerprint, std::size_t num_patches) {
  ArchiveReader archive(bytes);
  std::uint64_t format = 0, theirs = 0;
  archive(format);
  archive(theirs);
  if (format != kRowsFormat) return no_rows("they are none");
  if (theirs != fingerprint) {
    return Error{ErrorCode::kFailedPrecondition, "the kept rows are of another engine or system"};
  }
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
    const auto first = entries.begin() + static_cast<std::ptrdiff_t>(at);
    at += own.num_entries;
    TakenRow taken;
    taken.row = {{first, first + own.num_entries},
                 own.counted,
                 own.escaped,
                 own.absorbed,
                 own.traced,
                 own.clipped,
                 own.stated_error};
    if (!is_sound(own) || !is_sound(taken.row.entries, num_patches)) {
      ++block.num_refused;
      continue;
    }
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
  for (const std::string& name : checkpoints_->names()) {
    if (!name.starts_with(prefix_)) continue;
    std::uint64_t index = 0;
    std::from_chars(name.data() + prefix_.size(), name.data() + name.size(), index);
    next_index_ = std::max(next_index_, index + 1);
    num_blocks_ += recall(name);
  }
  wait_for_next();
}

/// Rows of another system, broken ones and those that do not fit into memory are sampled again. False: the block is of
/// no use to anybody.
bool RowCheckpoint::recall(const std::string& name) {
  try {
    const auto bytes = checkpoints_->load(name);
    if (!bytes) return false;
    Result<RowBlock> block = read_row_block(*bytes, fingerprint_, rows_.size());
    if (!block.ok()) {
      checkpoints_->warn(prefix_ + ": " + block.error().message);
      checkpoints_->drop({name});
      return false;
    }
    if (block->num_refused > 0) {
      checkpoints_->warn(name + ": " + std::to_string(block->num_refused) + " rows have impossible values");
    }
    for (std::size_t k = 0; k < block->rows.size(); ++k) {
      rows_[block->patches[k]] = std::move(block->rows[k]);
      state_[block->patches[k]] = kKept;
    }
  } catch (const std::bad_alloc&) {
    checkpoints_->warn("no memory to recall rows: they are sampled again");
  }
  return true;
}

void RowCheckpoint::add(std::uint32_t patch) {
  if (state_.empty() || state_[patch].load() == kKept) return;
  state_[patch].store(kSampled);
  if (Clock::now().time_since_epoch().count() < save_at_.load(std::memory_order_relaxed)) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock.owns_lock() && Clock::now().time_since_epoch().count() >= save_at_.load()) save();
}

void RowCheckpoint::save() {
  try {
    std::vector<std::uint32_t> patches;
    for (std::uint32_t patch = 0; patch < state_.size(); ++patch) {
      if (state_[patch].load() != kSampled) continue;
      patches.push_back(patch);
      state_[patch].store(kKept);
    }
    checkpoints_->save(prefix_ + std::to_string(next_index_), write_row_block(fingerprint_, patches, rows_));
  } catch (const std::bad_alloc&) {
    // Not these with the next ones, which would take still more.
    checkpoints_->warn("no memory to keep rows: another attempt samples them again");
  }
  ++next_index_;
  ++num_blocks_;
  wait_for_next();
}

void RowCheckpoint::wait_for_next() {
  const auto doublings = static_cast<int>(num_blocks_ / kBlocksPerDoubling);
  const double seconds = std::min(std::ldexp(checkpoints_->interval(), doublings), kLongestWait);
  save_at_ = (Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)))
                 .time_since_epoch()
                 .count();
}

}  // namespace radbake::radiosity
