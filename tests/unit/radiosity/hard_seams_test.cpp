// Hard case 17: rays at the seams of a closed box. By the numbers of tests/docs/hard_cases.md.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/sequence.h"
#include "server/radiosity/threads/for_each_range.h"
#include "server/radiosity/visibility/visibility.h"
#include "tests/record_figure.h"

namespace radbake::radiosity {
namespace {

/// Directions at points on and around the seams of a box of 12 triangles: the edges, the diagonals, the corners.
class SeamRays {
 public:
  SeamRays() {
    for (int k = 0; k < 8; ++k) {
      corners_.push_back({k & 1 ? 1.25 : -0.75, k & 2 ? 0.625 : -1.375, k & 4 ? 0.875 : -1.125});
    }
    const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
      box_.push_back({corners_[q[0]], corners_[q[1]], corners_[q[2]]});
      box_.push_back({corners_[q[0]], corners_[q[2]], corners_[q[3]]});
    }
    visibility_ = make_embree_visibility(box_);
  }

  /// How many of the rays [begin, end) leave the box.
  std::uint64_t escapes(std::uint64_t begin, std::uint64_t end) const {
    constexpr std::uint64_t kBatch = 4096;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::uint64_t escaped = 0;
    for (std::uint64_t first = begin; first < end; first += kBatch) {
      rays.clear();
      for (std::uint64_t i = first; i < std::min(end, first + kBatch); ++i) rays.push_back(ray(i));
      hits.resize(rays.size());
      visibility_->trace(rays, hits);
      for (const Hit& hit : hits) escaped += hit.triangle == kNoHit;
    }
    return escaped;
  }

 private:
  Ray ray(std::uint64_t i) const {
    std::uint64_t state = mixed_bits(i);
    const auto uniform = [&state] {
      state = mixed_bits(state);
      return static_cast<double>(state >> 11) * 0x1p-53;
    };
    // From anywhere inside, at a seam of a random triangle: its line, or within a few spacings of single precision.
    const Corners& triangle = box_[static_cast<std::size_t>(uniform() * 12)];
    const auto k = static_cast<std::size_t>(uniform() * 3);
    const double along = i % 16 == 0 ? 0 : uniform();  // every 16th: a corner
    Vec3 target = triangle[k] * (1 - along) + triangle[(k + 1) % 3] * along;
    const double aside = static_cast<double>(i % 5) * 0x1p-24;
    target += Vec3{uniform() - 0.5, uniform() - 0.5, uniform() - 0.5} * aside;
    const Vec3 low = corners_[0], size = corners_[7] - corners_[0];
    const Vec3 from{low.x + size.x * (0.01 + 0.98 * uniform()), low.y + size.y * (0.01 + 0.98 * uniform()),
                    low.z + size.z * (0.01 + 0.98 * uniform())};
    const Vec3 d = target - from;
    return {{static_cast<float>(from.x), static_cast<float>(from.y), static_cast<float>(from.z)},
            {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)}};
  }

  std::vector<Vec3> corners_;
  std::vector<Corners> box_;
  std::unique_ptr<Visibility> visibility_;
};

TEST(HardCase17Seams, LetNoneOfAMillionRaysOut) { EXPECT_EQ(SeamRays().escapes(0, 1'000'000), 0u); }

// Run by --gtest_also_run_disabled_tests: minutes.
TEST(HardCase17Seams, DISABLED_LetNoneOfABillionRaysOut) {
  constexpr std::uint64_t kRays = 1'000'000'000, kRange = 1'000'000;
  const SeamRays seams;
  std::vector<std::uint64_t> escaped(kRays / kRange, 0);
  for_each_range(escaped.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) escaped[k] = seams.escapes(k * kRange, (k + 1) * kRange);
  });
  std::uint64_t sum = 0;
  for (const std::uint64_t e : escaped) sum += e;
  EXPECT_EQ(sum, 0u);
  tests::record_figure("escaped", static_cast<double>(sum));
}

}  // namespace
}  // namespace radbake::radiosity
