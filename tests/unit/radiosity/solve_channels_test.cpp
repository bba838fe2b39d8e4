// A grey scene is solved in one channel: the same bits as in three equal ones, whatever solves and whatever holds the
// form factors.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "server/radiosity/transport/sparse_operator.h"
#include "server/radiosity/transport/streamed_operator.h"
#include "tests/unit/radiosity/solve_cases.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint32_t kPatches = 60;

struct NamedOperator {
  std::string name;
  std::unique_ptr<TransportOperator> transport;
};

/// The same rows in each operator there is.
std::vector<NamedOperator> every_operator() {
  const EstimatedRows rows = sampled_rows(kPatches, 11);
  RowSums sums{{}, {}, rows.areas};
  for (std::uint32_t i = 0; i < kPatches; ++i) {
    sums.measured.push_back(rows.measured_row_sum(i));
    sums.lengths.push_back(static_cast<std::uint32_t>(rows.first[i + 1] - rows.first[i]));
  }
  const RowSource source = [rows](std::uint32_t i, std::vector<EstimatedRows::Entry>& entries) {
    entries.assign(rows.entries.begin() + static_cast<std::ptrdiff_t>(rows.first[i]),
                   rows.entries.begin() + static_cast<std::ptrdiff_t>(rows.first[i + 1]));
  };
  std::vector<NamedOperator> operators;
  auto sparse = std::make_unique<SparseOperator>(rows);
  operators.push_back({"dense", std::make_unique<DenseOperator>(*sparse)});
  operators.push_back({"sparse", std::move(sparse)});
  operators.push_back({"by rows", std::make_unique<StreamedOperator>(sums, source, StreamedSystem::kByRows)});
  operators.push_back({"by columns", std::make_unique<StreamedOperator>(sums, source, StreamedSystem::kByColumns)});
  return operators;
}

bool can_solve(Solver solver, const TransportOperator& transport) {
  return transport.is_reciprocal() || transport.is_by_columns() == reads_columns(solver);
}

std::vector<Vec3> in_three(const std::vector<double>& values) {
  std::vector<Vec3> three;
  for (const double v : values) three.push_back({v, v, v});
  return three;
}

/// Light and reflectance of odd bits; a third of the patches is black.
GreyProblem grey_problem(double max_reflectance) {
  GreyProblem problem;
  for (std::uint32_t i = 0; i < kPatches; ++i) {
    problem.source.push_back(1e3 * std::fabs(std::sin(i + 1.0)));
    problem.reflectance.push_back(i % 3 == 0 ? 0 : max_reflectance * std::fabs(std::cos(i / 7.0)));
  }
  return problem;
}

/// All of a solve but its seconds.
struct Course {
  std::vector<Vec3> radiosity;
  std::vector<std::vector<Vec3>> seen;
  SolveReport report;
};

Course in_one_channel(Solver solver, const TransportOperator& transport, const GreyProblem& problem) {
  Course course;
  std::vector<double> radiosity = problem.source;
  const auto see = [&](const SolveViewOf<double>& view) {
    course.seen.push_back(in_three({view.radiosity.begin(), view.radiosity.end()}));
    course.seen.push_back(in_three({view.unshot.begin(), view.unshot.end()}));
  };
  course.report = solve(solver, transport, problem, {}, radiosity, see, {}).value();
  course.radiosity = in_three(radiosity);
  return course;
}

Course in_three_channels(Solver solver, const TransportOperator& transport, const GreyProblem& problem) {
  Course course;
  course.radiosity = in_three(problem.source);
  const auto see = [&](const SolveView& view) {
    course.seen.emplace_back(view.radiosity.begin(), view.radiosity.end());
    course.seen.emplace_back(view.unshot.begin(), view.unshot.end());
  };
  course.report = solve(solver, transport, RadiosityProblem{in_three(problem.source), in_three(problem.reflectance)},
                        {}, course.radiosity, see, {})
                      .value();
  return course;
}

void expect_equal(const Course& one, const Course& three) {
  EXPECT_EQ(one.radiosity, three.radiosity);
  EXPECT_EQ(one.seen, three.seen);
  EXPECT_EQ(one.report.status, three.report.status);
  EXPECT_EQ(one.report.steps, three.report.steps);
  EXPECT_EQ(one.report.sweeps, three.report.sweeps);
  EXPECT_EQ(one.report.work, three.report.work);
  EXPECT_EQ(one.report.residual, three.report.residual);
  EXPECT_EQ(one.report.error_bound, three.report.error_bound);
  EXPECT_EQ(one.report.relative_error_bound, three.report.relative_error_bound);
  EXPECT_EQ(one.report.unshot, three.report.unshot);
  ASSERT_EQ(one.report.history.size(), three.report.history.size());
  for (std::size_t k = 0; k < one.report.history.size(); ++k) {
    EXPECT_EQ(one.report.history[k].steps, three.report.history[k].steps);
    EXPECT_EQ(one.report.history[k].work, three.report.history[k].work);
    EXPECT_EQ(one.report.history[k].residual, three.report.history[k].residual);
    EXPECT_EQ(one.report.history[k].error_bound, three.report.history[k].error_bound);
    EXPECT_EQ(one.report.history[k].relative_error_bound, three.report.history[k].relative_error_bound);
  }
}

TEST(Channels, MeanOfEqualOnesIsTheirValueToTheLastBit) {
  int num_rounded = 0;
  for (int k = 1; k <= 1000; ++k) {
    const double x = std::sqrt(k) * 1e-3;
    EXPECT_EQ(mean_of_channels(Vec3{x, x, x}), x);
    num_rounded += mean_component({x, x, x}) != x;
  }
  EXPECT_GT(num_rounded, 0) << "the plain mean would do";
  EXPECT_EQ(mean_of_channels(Vec3{1, 2, 6}), 3);
}

TEST(TransportOperator, GathersOneChannelAsItGathersThree) {
  const std::vector<double> light = grey_problem(0.9).source;
  const std::vector<Vec3> light_in_three = in_three(light);
  for (const auto& [name, transport] : every_operator()) {
    std::vector<double> one(kPatches);
    std::vector<Vec3> three(kPatches);
    transport->gather(light, one);
    transport->gather(light_in_three, three);
    EXPECT_EQ(in_three(one), three) << name;
    for (std::uint32_t i = 0; i < kPatches && !transport->is_by_columns(); ++i) {
      EXPECT_EQ(transport->gather_at(i, light), one[i]) << name;
      EXPECT_EQ(transport->gather_at(i, light_in_three), three[i]) << name;
    }
  }
}

TEST(Solve, TakesTheSameCourseInOneChannelAsInThreeEqualOnes) {
  for (const auto& [name, transport] : every_operator()) {
    for (const Solver solver : kAllSolvers) {
      if (!can_solve(solver, *transport)) continue;
      for (const double max_reflectance : {0.3, 0.9}) {
        SCOPED_TRACE(name + ", " + solver_name(solver) + ", " + std::to_string(max_reflectance));
        const GreyProblem problem = grey_problem(max_reflectance);
        const Course one = in_one_channel(solver, *transport, problem);
        EXPECT_EQ(one.report.status, SolveStatus::kConverged);
        expect_equal(one, in_three_channels(solver, *transport, problem));
      }
    }
  }
}

TEST(Solve, SharpensItsBoundInOneChannelAsInThreeEqualOnes) {
  // Closed, and nearly all is reflected: the plain bound does not do.
  const DenseOperator transport = random_enclosure(kPatches, 0.5, 3).transport;
  const GreyProblem problem = grey_problem(0.9999);
  for (const Solver solver : kAllSolvers) {
    SCOPED_TRACE(solver_name(solver));
    expect_equal(in_one_channel(solver, transport, problem), in_three_channels(solver, transport, problem));
  }
}

TEST(Solve, DivergesInOneChannelWhereItDoesInThree) {
  GreyProblem problem = grey_problem(0.9);
  problem.source[7] = std::nan("");
  const SparseOperator sparse(sampled_rows(kPatches, 11));
  for (const Solver solver : kAllSolvers) {
    EXPECT_EQ(in_one_channel(solver, sparse, problem).report.status, SolveStatus::kDiverged) << solver_name(solver);
    EXPECT_EQ(in_three_channels(solver, sparse, problem).report.status, SolveStatus::kDiverged) << solver_name(solver);
  }
}

TEST(SolveGrey, GivesTheBitsOfThreeChannelsWhereTheyAreEqual) {
  const SparseOperator sparse(sampled_rows(kPatches, 11));
  const GreyProblem grey = grey_problem(0.9);
  const RadiosityProblem problem{in_three(grey.source), in_three(grey.reflectance)};
  for (const Solver solver : kAllSolvers) {
    std::vector<Vec3> radiosity = problem.source;
    const SolveReport report = solve_grey(solver, sparse, problem, {}, radiosity, nullptr, {}).value();
    const Course three = in_three_channels(solver, sparse, grey);
    EXPECT_EQ(radiosity, three.radiosity) << solver_name(solver);
    EXPECT_EQ(report.error_bound, three.report.error_bound) << solver_name(solver);
  }
}

TEST(SolveGrey, SolvesTheMeanOfColours) {
  // B_0 = (E_0 + rho_0 E_1) / (1 - rho_0 rho_1) with means 2 and 6, 0.5 and 0.25.
  const RadiosityProblem problem{{{1, 2, 3}, {0, 6, 12}}, {{0.25, 0.5, 0.75}, {0.5, 0.25, 0}}};
  std::vector<Vec3> radiosity(2);
  ASSERT_TRUE(solve_grey(Solver::kLu, facing_pair(), problem, {}, radiosity, nullptr, {}).ok());
  constexpr double kRounding = 1e-14;
  EXPECT_NEAR(radiosity[0].x, (2 + 0.5 * 6) / (1 - 0.5 * 0.25), kRounding * 10);
  EXPECT_EQ(radiosity[0].x, radiosity[0].y);
  EXPECT_EQ(radiosity[0].x, radiosity[0].z);
}

TEST(SolveGrey, RefusesWhatSolveRefuses) {
  const SparseOperator sparse(sampled_rows(kPatches, 11));
  const RadiosityProblem problem{in_three(grey_problem(0.9).source), in_three(grey_problem(0.9).reflectance)};
  SolveOptions options;
  options.max_lu_patches = kPatches - 1;
  std::vector<Vec3> radiosity(kPatches);
  const auto refused = solve_grey(Solver::kLu, sparse, problem, options, radiosity, nullptr, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("59 patches"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace radbake::radiosity
