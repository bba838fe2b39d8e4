#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "client/image/write_image.h"
#include "server/study/bake_study.h"
#include "server/study/commands.h"
#include "server/study/convergence_study.h"
#include "server/study/study_scene.h"
#include "tests/scenes/rooms.h"

namespace radbake::study {
namespace {

namespace fs = std::filesystem;

radiosity::BakeOptions small_bake() {
  radiosity::BakeOptions options;
  options.max_patches = 200;
  options.rays = 64;
  options.texels_per_meter = 2;
  return options;
}

constexpr double kTolerance = 1e-8;

const ConvergenceStudy& small_study() {
  static const ConvergenceStudy study =
      study_convergence_of(tests::small_emitter_room(0.8), small_bake(), kTolerance).value();
  return study;
}

const ConvergenceCurve& curve(const ConvergenceStudy& study, const std::string& name) {
  return *std::find_if(study.curves.begin(), study.curves.end(),
                       [&](const ConvergenceCurve& c) { return c.name == name; });
}

/// Patches until the error is within a limit.
double patches_until(const ConvergenceCurve& curve, double limit) {
  for (const ConvergencePoint& point : curve.points) {
    if (point.error <= limit) return static_cast<double>(point.patches);
  }
  return INFINITY;
}

TEST(Convergence, OfEverySolverEndsAtTheSameSolution) {
  ASSERT_EQ(small_study().curves.size(), 7U);
  for (const ConvergenceCurve& c : small_study().curves) {
    EXPECT_EQ(c.status, "converged") << c.name;
    ASSERT_GE(c.points.size(), 2U) << c.name;
    EXPECT_EQ(c.points.front().error, 1) << c.name;  // from 0
    // The bound is on the largest error over the mean; the mean square is below the former and above the latter.
    EXPECT_LE(c.points.back().error, kTolerance) << c.name;
    EXPECT_TRUE(std::is_sorted(c.points.begin(), c.points.end(), [](const auto& a, const auto& b) {
      return a.steps < b.steps && a.work <= b.work && a.seconds <= b.seconds;
    })) << c.name;
  }
  EXPECT_LE(small_study().reference_error, kTolerance / 100);
}

TEST(Convergence, ShowsTheClassicOrder) {
  const auto until = [](const char* name) { return patches_until(curve(small_study(), name), 0.05); };
  EXPECT_LT(until("shooting+ambient"), until("shooting"));
  EXPECT_LT(until("shooting"), until("gauss-seidel"));
  EXPECT_LT(until("gauss-seidel"), until("jacobi"));
}

TEST(Convergence, IsTheSameForAnyNumberOfThreads) {
  radiosity::BakeOptions options = small_bake();
  options.threads = 1;
  const ConvergenceStudy alone = study_convergence_of(tests::small_emitter_room(0.8), options, kTolerance).value();
  ASSERT_EQ(alone.curves.size(), small_study().curves.size());
  for (std::size_t c = 0; c < alone.curves.size(); ++c) {
    const auto &one = alone.curves[c].points, &many = small_study().curves[c].points;
    ASSERT_EQ(one.size(), many.size());
    for (std::size_t k = 0; k < one.size(); ++k) EXPECT_EQ(one[k].error, many[k].error);
  }
}

TEST(Convergence, RefusesAStreamedOperator) {
  radiosity::BakeOptions options = small_bake();
  options.transport = radiosity::Transport::kStreamed;
  const auto refused = study_convergence_of(tests::small_emitter_room(0.8), options, kTolerance);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("--transport sparse or dense"), std::string::npos);
}

TEST(Convergence, TableAndPlotHoldEveryCurve) {
  const std::string csv = convergence_csv(small_study()), table = convergence_table(small_study());
  std::size_t num_points = 0;
  for (const ConvergenceCurve& c : small_study().curves) {
    num_points += c.points.size();
    EXPECT_NE(csv.find("\n" + c.name + ",0,0,"), std::string::npos) << c.name;
    EXPECT_NE(table.find("\n" + c.name + " "), std::string::npos) << c.name;
  }
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), 1 + num_points);
  for (const Panel& panel : convergence_plot(small_study()).panels) EXPECT_EQ(panel.curves.size(), 7U);
}

TEST(BakeStudy, WritesTheLightmapsOfTheBakeItself) {
  const Scene scene = tests::small_emitter_room(0.5);
  const TimedBake bake = bake_timed(scene, small_bake()).value();
  const fs::path folder = fs::path(testing::TempDir()) / "bake_study";
  fs::create_directories(folder);
  ASSERT_TRUE(write_lightmaps(bake.outcome, folder).ok());
  ASSERT_EQ(bake.outcome.layers.size(), 2U);
  EXPECT_EQ(bake.outcome.layers[1].name, "error_0");
  EXPECT_EQ(image::read_exr(folder / "lightmap_0.exr").value().values, bake.outcome.layers[0].values);

  double of_stages = 0;
  for (const radiosity::StageTime& stage : bake.outcome.report.stages) {
    of_stages += stage.seconds;
    EXPECT_NE(bake_table(bake).find(stage.stage), std::string::npos);
  }
  EXPECT_LE(of_stages, bake.seconds);
  EXPECT_NE(bake_table(bake).find("hemisphere form factors, "), std::string::npos);
}

TEST(BakeStudy, SaysWhichOptionIsRefused) {
  radiosity::BakeOptions options = small_bake();
  options.rays = 3;
  const auto refused = bake_timed(tests::small_emitter_room(0.5), options);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("rays"), std::string::npos);
}

TEST(StudyScene, IsReadWithTheLightsThatWereAskedFor) {
  options::BakeChoices choices;
  choices.sky = Vec3{1, 2, 3};
  const StudyScene read = read_study_scene(RADBAKE_CORNELL_BOX, choices).value();
  EXPECT_EQ(read.scene.sky, (Vec3{1, 2, 3}));
  EXPECT_FALSE(read.scene.meshes.empty());
  EXPECT_NE(read_study_scene("/nowhere/room.glb", choices).error().message.find("room.glb"), std::string::npos);
}

TEST(StudyCommands, SayByTheirExitWhatWentWrong) {
  const fs::path folder = fs::path(testing::TempDir()) / "study_commands";
  fs::remove_all(folder);
  EXPECT_EQ(run_bake({"/nowhere/room.glb", folder.string(), 0, {}}), kBadInput);
  EXPECT_EQ(run_rates("/nowhere/cases.json", folder.string()), kBadInput);
  EXPECT_FALSE(fs::exists(folder));
  const fs::path file = fs::path(testing::TempDir()) / "study_file";
  std::ofstream(file) << "no folder";
  EXPECT_EQ(run_bake({RADBAKE_CORNELL_BOX, (file / "inside").string(), 0, {}}), kNotWritten);
  SceneChoices refused{RADBAKE_CORNELL_BOX, folder.string(), 0, {}};
  refused.bake.rays = 3;
  EXPECT_EQ(run_bake(refused), kBadInput);
}

}  // namespace
}  // namespace radbake::study
