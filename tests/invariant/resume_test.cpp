// Bakes that are stopped at any moment and go on from what they kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <new>

#include "common/base/version.h"
#include "server/radiosity/bake/row_checkpoint.h"
#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {
namespace {

using radiosity::BakeOptions;
using radiosity::BakeOutcome;
using testing::Contains;
using testing::HasSubstr;

/// Their number stands behind the block's format and fingerprint.
std::uint64_t num_rows_of(const std::string& block) {
  std::uint64_t count = 0;
  std::memcpy(&count, block.data() + 2 * sizeof(std::uint64_t), sizeof count);
  return count;
}

/// Keeps everything at once, and ends the bake after so many savings.
class MemoryCheckpoints final : public radiosity::Checkpoints {
 public:
  std::vector<std::string> names() const override {
    std::vector<std::string> names;
    for (const auto& [name, bytes] : kept) names.push_back(name);
    return names;
  }
  std::optional<std::string> load(const std::string& name) override {
    const auto found = kept.find(name);
    if (has_no_memory) throw std::bad_alloc();
    if (found == kept.end()) return std::nullopt;
    return found->second;
  }
  void save(const std::string& name, const std::string& bytes) override {
    if (has_no_memory) throw std::bad_alloc();
    kept[name] = bytes;
    if (name == "pass") {
      ++num_passes_saved;
    } else {
      num_rows_saved += num_rows_of(bytes);
    }
    if (++num_saved == stop_after) stop.request_stop();
  }
  void drop(const std::vector<std::string>& names) override {
    for (const std::string& name : names) kept.erase(name);
  }
  void warn(const std::string& text) override { warnings.push_back(text); }
  double interval() const override { return seconds; }

  double seconds = 0;
  bool has_no_memory = false;  ///< for what is kept
  std::vector<std::string> warnings;
  std::map<std::string, std::string> kept;
  int num_saved = 0, num_passes_saved = 0, stop_after = 0;  ///< 0: never
  std::uint64_t num_rows_saved = 0;
  std::stop_source stop;
};

/// A room with a lamp, a panel and a leaf: direct and gathered light, two sides, masked rows.
Scene curtained_room() {
  RoomBuilder builder(4);
  builder.add_box("room", {0, 0, 0}, {4, 3, 5}, builder.add_material("paint", {0.7, 0.5, 0.3}), true);
  builder.add_quad("panel", {1, 2.9, 1}, {1, 0, 0}, {0, 0, 1},
                   builder.add_material("glow", {0, 0, 0}, {5000, 4000, 3000}));
  const int curtain = builder.add_material("curtain", {0.4, 0.4, 0.4}, {}, true);
  builder.scene().materials[static_cast<std::size_t>(curtain)].diffuse_transmittance = {0.3, 0.2, 0.1};
  builder.add_quad("curtain", {2.5, 0.1, 0.5}, {0, 2, 0}, {0, 0, 3}, curtain);
  builder.scene().lights.push_back({"lamp", PointLight{{1, 1.5, 2.5}, {100, 100, 100}}});
  return std::move(builder.scene());
}

Result<BakeOutcome> bake_with(const Scene& scene, const BakeOptions& options, MemoryCheckpoints& checkpoints) {
  SilentObserver observer;
  return radiosity::bake_scene(scene, options, observer, checkpoints.stop.get_token(), {}, &checkpoints);
}

void expect_same(const BakeOutcome& a, const BakeOutcome& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t i = 0; i < a.layers.size(); ++i)
    EXPECT_EQ(a.layers[i].values, b.layers[i].values) << a.layers[i].name;
  ASSERT_EQ(a.report.passes.size(), b.report.passes.size());
  for (std::size_t p = 0; p < a.report.passes.size(); ++p) {
    EXPECT_EQ(a.report.passes[p].relative_rmse, b.report.passes[p].relative_rmse);
    EXPECT_EQ(a.report.passes[p].num_row_rays, b.report.passes[p].num_row_rays);
  }
  EXPECT_EQ(a.report.num_patches, b.report.num_patches);
  EXPECT_EQ(a.report.num_row_rays, b.report.num_row_rays);
  EXPECT_EQ(a.report.num_gather_rays, b.report.num_gather_rays);
  EXPECT_EQ(a.report.num_light_rays, b.report.num_light_rays);
  EXPECT_EQ(a.report.solver.history.size(), b.report.solver.history.size());
  EXPECT_EQ(a.report.energy.gap, b.report.energy.gap);
  EXPECT_EQ(a.report.warnings.size(), b.report.warnings.size());
  EXPECT_EQ(a.report.error.relative_rmse, b.report.error.relative_rmse);
  EXPECT_EQ(a.report.error.limited_by, b.report.error.limited_by);
}

TEST(Resume, GivesTheSameBytesWhereverABakeWasStopped) {
  const Scene scene = curtained_room();
  const BakeOptions options{.atlas_size = 64, .max_patches = 300, .seed = 5, .wants_direct = true, .max_error = 0.02};
  const BakeOutcome whole = baked(scene, options);
  ASSERT_GT(whole.report.passes.size(), 1u);
  int num_saved_in_all = 0;
  std::uint64_t num_rows_in_all = 0;
  {
    MemoryCheckpoints checkpoints;
    expect_same(whole, *bake_with(scene, options, checkpoints));
    num_saved_in_all = checkpoints.num_saved;
    num_rows_in_all = checkpoints.num_rows_saved;
    EXPECT_EQ(static_cast<std::size_t>(checkpoints.num_passes_saved), whole.report.passes.size());
  }
  // At the first saving, in the midst of rows, at the ends of passes.
  for (const double part : {0.0, 0.1, 0.3, 0.6, 0.9, 0.99}) {
    SCOPED_TRACE(part);
    MemoryCheckpoints first;
    first.stop_after = 1 + static_cast<int>(part * num_saved_in_all);
    const auto stopped = bake_with(scene, options, first);
    if (stopped.ok()) continue;  // its last saving was its end
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
    MemoryCheckpoints second;
    second.kept = first.kept;
    const auto resumed = bake_with(scene, options, second);
    ASSERT_TRUE(resumed.ok()) << resumed.error().message;
    expect_same(whole, *resumed);
    // What was kept was not made again.
    EXPECT_LE(second.num_passes_saved + first.num_passes_saved, static_cast<int>(whole.report.passes.size()));
    // The last rows of a system may not be saved: those that were sampled while a block was.
    constexpr std::uint64_t kUnsaved = 200;
    EXPECT_LE(second.num_rows_saved + first.num_rows_saved, num_rows_in_all + kUnsaved);
  }
}

TEST(Resume, GoesOnWithTheRowsOfABakeOfFixedRays) {
  const Scene scene = curtained_room();
  const BakeOptions options{.atlas_size = 64, .rays = 64, .max_patches = 200, .output = radiosity::Output::kBoth};
  const BakeOutcome whole = baked(scene, options);
  MemoryCheckpoints first;
  first.stop_after = 150;
  ASSERT_FALSE(bake_with(scene, options, first).ok());
  MemoryCheckpoints second;
  second.kept = first.kept;
  expect_same(whole, *bake_with(scene, options, second));
}

TEST(Resume, MakesAgainWhatIsOfAnotherBakeOrBroken) {
  const Scene scene = curtained_room();
  BakeOptions options{.atlas_size = 64, .max_patches = 200, .seed = 5, .max_error = 0.05};
  const BakeOutcome whole = baked(scene, options);
  MemoryCheckpoints other;
  options.seed = 6;
  other.stop_after = 300;
  (void)bake_with(scene, options, other).ok();
  options.seed = 5;
  MemoryCheckpoints found;
  found.kept = other.kept;
  ASSERT_FALSE(found.kept.empty());
  found.kept["pass"] = "no pass";
  expect_same(whole, *bake_with(scene, options, found));
  // One that breaks off in the midst of the maps.
  MemoryCheckpoints passes;
  (void)bake_with(scene, options, passes).ok();
  MemoryCheckpoints half;
  half.kept["pass"] = passes.kept["pass"].substr(0, passes.kept["pass"].size() / 2);
  expect_same(whole, *bake_with(scene, options, half));
}

TEST(Resume, NeedsNoMemoryForWhatIsKept) {
  const Scene scene = curtained_room();
  const BakeOptions options{.atlas_size = 64, .max_patches = 200, .seed = 5, .max_error = 0.05};
  const BakeOutcome whole = baked(scene, options);
  MemoryCheckpoints kept;
  (void)bake_with(scene, options, kept).ok();
  MemoryCheckpoints none;
  none.has_no_memory = true;
  none.kept = kept.kept;
  const auto outcome = bake_with(scene, options, none);
  ASSERT_TRUE(outcome.ok()) << outcome.error().message;
  expect_same(whole, *outcome);
  EXPECT_THAT(none.warnings, Contains(HasSubstr("no memory to recall the passes")));
  EXPECT_THAT(none.warnings, Contains(HasSubstr("no memory to keep rows")));
  EXPECT_THAT(none.warnings, Contains(HasSubstr("no memory to keep the passes")));
}

TEST(Resume, MakesAgainWhatAnotherEngineKept) {
  const Scene scene = curtained_room();
  const BakeOptions options{.atlas_size = 64, .max_patches = 200, .seed = 5, .max_error = 0.05};
  MemoryCheckpoints older;
  const BakeOutcome whole = *bake_with(scene, options, older);
  std::string& pass = older.kept["pass"];
  const std::size_t version = pass.find(kEngineVersion);
  ASSERT_NE(version, std::string::npos);
  pass[version] ^= 1;
  MemoryCheckpoints found;
  found.kept = {{"pass", pass}};
  expect_same(whole, *bake_with(scene, options, found));
  EXPECT_THAT(found.warnings, Contains(HasSubstr("another engine")));
  EXPECT_EQ(found.num_passes_saved, older.num_passes_saved);
}

TEST(RowCheckpoint, WritesOverNoBlockWhereOneIsMissing) {
  MemoryCheckpoints checkpoints;
  std::vector<radiosity::TakenRow> rows(3);
  const std::string last = radiosity::write_row_block(7, {1}, rows);
  checkpoints.kept = {{"rows/1/0", "broken"}, {"rows/1/11", last}, {"rows/10/70", "of others"}};
  radiosity::RowCheckpoint checkpoint(&checkpoints, "rows/1/", 7, rows);
  EXPECT_TRUE(checkpoint.is_known(1));
  checkpoint.add(2);
  EXPECT_EQ(checkpoints.kept["rows/1/11"], last);
  EXPECT_TRUE(checkpoints.kept.contains("rows/1/12"));
  EXPECT_FALSE(checkpoints.kept.contains("rows/1/0"));
}

TEST(RowCheckpoint, KeepsLessOftenTheMoreBlocksThereAre) {
  std::vector<radiosity::TakenRow> rows(3);
  MemoryCheckpoints checkpoints;
  checkpoints.seconds = 1e-9;
  radiosity::RowCheckpoint few(&checkpoints, "rows/1/", 7, rows);
  few.add(0);
  EXPECT_EQ(checkpoints.num_saved, 1);
  const std::string none = radiosity::write_row_block(7, {}, rows);
  // A nanosecond, doubled by every eight of them: longer than a test.
  for (int block = 1; block < 400; ++block) checkpoints.kept["rows/1/" + std::to_string(block)] = none;
  radiosity::RowCheckpoint many(&checkpoints, "rows/1/", 7, rows);
  many.add(1);
  EXPECT_EQ(checkpoints.num_saved, 1);
}

TEST(RowBlock, ReadsBackWhatWasWrittenAndNothingElse) {
  std::vector<radiosity::TakenRow> rows(5);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].row.entries = {{static_cast<std::uint32_t>(i), 2.5F}};
    rows[i].row.counted = 16;
    rows[i].length = 1;
    rows[i].sample.reflectance = {0.5, 0.25, 0.125};
  }
  const std::string bytes = radiosity::write_row_block(7, {1, 4}, rows);
  const auto read = radiosity::read_row_block(bytes, 7, rows.size());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->patches, (std::vector<std::uint32_t>{1, 4}));
  EXPECT_EQ(read->rows[1].row.entries[0].patch, 4u);
  EXPECT_EQ(read->rows[1].row.entries[0].weight, 2.5F);
  EXPECT_EQ(read->rows[0].sample.reflectance, (Vec3{0.5, 0.25, 0.125}));

  EXPECT_EQ(radiosity::read_row_block(bytes, 8, rows.size()).error().code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(radiosity::read_row_block(bytes, 7, 4).error().code, ErrorCode::kDataLoss);  // there is no patch 4
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(radiosity::read_row_block(bytes.substr(0, size), 7, rows.size()).ok()) << size;
  }
  EXPECT_FALSE(radiosity::read_row_block(bytes + '\0', 7, rows.size()).ok());
}

TEST(RowBlock, LeavesOutRowsThatNoSceneHas) {
  std::vector<radiosity::TakenRow> rows(5);
  rows[0].row.entries = {{3, 1.0F}, {3, 1.0F}};
  rows[1].row.entries = {{3, std::nanf("")}};
  rows[2].row.entries = {{1, 1.0F}, {3, 1.0F}};
  rows[3].sample.reflectance = {1.5, 0.5, 0.5};
  rows[4].row.counted = 16;
  rows[4].row.absorbed = -1;
  const auto read = radiosity::read_row_block(radiosity::write_row_block(7, {0, 1, 2, 3, 4}, rows), 7, rows.size());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->patches, (std::vector<std::uint32_t>{2}));
  EXPECT_EQ(read->num_refused, 4u);
  EXPECT_EQ(read->rows[0].row.entries[1].patch, 3u);
}

TEST(RowBlock, TakesWhatRoundingLeavesOutsideTheLimits) {
  std::vector<radiosity::TakenRow> rows(2);
  // Half reflected, half passed on: of what does not pass, all is reflected.
  rows[0].sample.reflectance = {1, 1, 1};
  rows[1].row.counted = 65536;
  rows[1].row.absorbed = -1e-12;
  const auto read = radiosity::read_row_block(radiosity::write_row_block(7, {0, 1}, rows), 7, rows.size());
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->num_refused, 0u);
}

}  // namespace
}  // namespace radbake::tests
