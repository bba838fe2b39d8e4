// Rows as an earlier attempt at a bake kept them: from the server's own disk, and decisive for the result.

#include <cmath>
#include <string_view>

#include "common/base/check.h"
#include "server/radiosity/bake/row_checkpoint.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace radbake;
  // As those of the corpus.
  constexpr std::uint64_t kFingerprint = 7;
  constexpr std::size_t kPatches = 100;
  const auto block = radiosity::read_row_block({reinterpret_cast<const char*>(bytes), size}, kFingerprint, kPatches);
  if (!block.ok()) return 0;
  RADBAKE_CHECK_EQ(block->patches.size(), block->rows.size());
  for (std::size_t k = 0; k < block->rows.size(); ++k) {
    RADBAKE_CHECK_LT(block->patches[k], kPatches);
    const radiosity::TakenRow& taken = block->rows[k];
    constexpr double kRounding = 1e-6;
    RADBAKE_CHECK(max_component(taken.sample.reflectance) <= 1 + kRounding);
    std::int64_t last = -1;
    for (const auto& entry : taken.row.entries) {
      RADBAKE_CHECK_LT(entry.patch, kPatches);
      RADBAKE_CHECK(entry.patch > last && entry.weight > 0 && std::isfinite(entry.weight));
      last = entry.patch;
    }
  }
  // What is sound is written as it was read.
  std::vector<radiosity::TakenRow> rows(kPatches);
  for (std::size_t k = 0; k < block->rows.size(); ++k) rows[block->patches[k]] = block->rows[k];
  RADBAKE_CHECK(
      radiosity::read_row_block(radiosity::write_row_block(kFingerprint, block->patches, rows), kFingerprint, kPatches)
          .ok());
  return 0;
}
