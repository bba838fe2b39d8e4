#include "server/radiosity/plan/plan.h"

#include <gtest/gtest.h>

namespace radbake::radiosity {
namespace {

TEST(BakeOptions, AreAllRightWhenNothingIsAsked) { EXPECT_TRUE(check_options({}).ok()); }

TEST(BakeOptions, AreRefusedByNameAndValue) {
  const auto message = [](const BakeOptions& options) {
    const auto checked = check_options(options);
    return checked.ok() ? std::string() : checked.error().message;
  };
  EXPECT_EQ(message({.atlas_size = 63}), "atlas size 63 is not within 64..4096");
  EXPECT_EQ(message({.atlas_size = 8192}), "atlas size 8192 is not within 64..4096");
  EXPECT_EQ(message({.rays = 7}), "rays 7 is not within 8..65536");
  EXPECT_EQ(message({.max_patches = 63}), "max patches 63 is not within 64..16777216");
  EXPECT_EQ(message({.ao_distance = -1}), "ambient occlusion distance -1 is not within 1e-06..1e+09");
  EXPECT_EQ(message({.threads = -1}), "threads -1 is not within 1..4096");
}

// Area 1: four texels of 0.001 would make 62,500 patches; at least 1024, at most what is asked.
TEST(PatchEdge, IsFourTexelsWithinTheBoundsOnTheNumberOfPatches) {
  EXPECT_DOUBLE_EQ(patch_edge(0.001, 1, 100000), 0.004);
  EXPECT_DOUBLE_EQ(patch_edge(0.001, 1, 10000), 0.01);
  EXPECT_DOUBLE_EQ(patch_edge(0.1, 1, 100000), 1.0 / 32);
  EXPECT_DOUBLE_EQ(patch_edge(0.1, 1, 100), 0.1);
}

TEST(TransportChoice, TakesTheFastestThatFitsTheMemory) {
  constexpr std::uint64_t kGigabyte = std::uint64_t{1} << 30;
  // Full rows are smaller written out; rows with few entries are not.
  EXPECT_EQ(choose_transport(400, 400, kGigabyte), Transport::kDense);
  EXPECT_EQ(choose_transport(400, 200, kGigabyte), Transport::kDense);
  EXPECT_EQ(choose_transport(16384, 256, kGigabyte), Transport::kSparse);
  // 16384 rows of 256 rays take at most 128 MiB.
  EXPECT_EQ(transport_bytes(Transport::kSparse, 16384, 256), std::uint64_t{16384} * 32 * 256);
  EXPECT_EQ(choose_transport(16384, 256, std::uint64_t{16384} * 32 * 256), Transport::kSparse);
  EXPECT_EQ(choose_transport(16384, 256, std::uint64_t{16384} * 32 * 256 - 1), Transport::kStreamed);
  EXPECT_EQ(choose_transport(400, 400, 1024), Transport::kStreamed);
}

/// A plan of so many patches, as far as methods are chosen by it.
BakePlan plan_of(std::uint64_t num_patches, double max_reflectance) {
  BakePlan plan;
  plan.num_patches = num_patches;
  plan.rays_per_row = 256;
  plan.survey.max_reflectance = max_reflectance;
  return plan;
}

TEST(BakePlan, ChoosesMethodsThatSuitTheScene) {
  BakePlan plan = plan_of(5000, 0.8);
  choose_methods({}, plan);
  EXPECT_EQ(plan.form_factors, FormFactors::kHemisphere);
  EXPECT_EQ(plan.transport, Transport::kSparse);
  EXPECT_EQ(plan.solver, Solver::kGaussSeidel);
  EXPECT_EQ(plan.transport_bytes, std::uint64_t{5000} * 32 * 256);
  EXPECT_EQ(plan.transport_bytes_limit, kDefaultTransportMemory);

  plan = plan_of(5000, 0.96);
  choose_methods({}, plan);
  EXPECT_EQ(plan.solver, Solver::kKrylov);

  // A sweep that traces every row again is dear at any reflectance.
  plan = plan_of(5000, 0.5);
  choose_methods({.transport_memory = 1 << 20}, plan);
  EXPECT_EQ(plan.transport, Transport::kStreamed);
  EXPECT_EQ(plan.solver, Solver::kKrylov);
}

TEST(BakePlan, LeavesToTheUserWhatIsAskedByName) {
  BakePlan plan = plan_of(5000, 0.99);
  choose_methods({.form_factors = FormFactors::kAnalytic,
                  .transport = Transport::kDense,
                  .solver = Solver::kLu,
                  .transport_memory = 1 << 20},
                 plan);
  EXPECT_EQ(plan.form_factors, FormFactors::kAnalytic);
  EXPECT_EQ(plan.transport, Transport::kDense);
  EXPECT_EQ(plan.solver, Solver::kLu);
  EXPECT_GT(plan.transport_bytes, plan.transport_bytes_limit);
}

TEST(BakePlan, AllowsTheSweepsThatAHighReflectanceNeeds) {
  // rho^k (1 - rho)^-1 = 1e-6 at rho 0.9999: k = 230 000, and as many again.
  EXPECT_NEAR(max_sweeps_of(0.9999, 1e-6), 2 * 230'000, 10'000);
  EXPECT_EQ(max_sweeps_of(0.5, 1e-6), SolveOptions{}.max_sweeps);
  EXPECT_EQ(max_sweeps_of(0, 1e-6), SolveOptions{}.max_sweeps);
}

}  // namespace
}  // namespace radbake::radiosity
