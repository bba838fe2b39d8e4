#include "server/study/accuracy_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "client/image/write_image.h"
#include "server/study/accuracy_front.h"
#include "server/study/accuracy_report.h"
#include "server/study/commands.h"
#include "tests/scenes/effect_rooms.h"
#include "tests/scenes/rooms.h"

namespace radbake::study {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A run of one bake.
AccuracyRun fixed_run(AccuracyAxis axis, const std::string& value, double cpu_seconds, double error) {
  radiosity::BakeOptions options;
  options.rays = 64;
  options.spacing = 4;
  options.light_samples = 16;
  options.max_patches = 1000;
  return {FixedSetting{axis, value, options}, 0, 0, {{cpu_seconds, cpu_seconds / 2, error, error, error}}};
}

/// Three settings of which one is beaten by another, and a progressive bake of two passes.
AccuracyStudy study_by_hand() {
  AccuracyStudy study;
  study.scene = "room.glb";
  study.num_texels = 900;
  study.num_compared = 700;
  study.reference.origin = "a file";
  study.reference.error = 0.003;
  study.runs = {fixed_run(AccuracyAxis::kRays, "64", 1, 0.08),
                fixed_run(AccuracyAxis::kRays, "16", 2, 0.16),
                fixed_run(AccuracyAxis::kRays, "256", 4, 0.02),
                {std::nullopt, 0.05, 0, {{1, 1, 0.1, 0.1, 0.09}, {2, 1, 0.05, 0.05, 0.045}}}};
  study.left_out = {"rays 3: refused"};
  return study;
}

TEST(AccuracyFront, HoldsWhatNoOtherBeatsFromCheapToExact) {
  const AccuracyStudy study = study_by_hand();
  const AccuracyFront front = front_of(study);
  ASSERT_EQ(front.runs.size(), 2U);
  EXPECT_EQ(front.runs[0]->setting->value, "64");
  EXPECT_EQ(front.runs[1]->setting->value, "256");
  EXPECT_EQ(front.cheapest_within(0.1)->setting->value, "64");
  EXPECT_EQ(front.cheapest_within(0.05)->setting->value, "256");
  EXPECT_EQ(front.cheapest_within(0.01), nullptr);
}

TEST(AccuracyFront, LiesBetweenItsSettingsOnALineOfLogarithms) {
  const AccuracyStudy study = study_by_hand();
  const AccuracyFront front = front_of(study);
  // 0.08 at 1 s, 0.02 at 4 s: 1/x.
  EXPECT_NEAR(front.error_at(2).value(), 0.04, 1e-12);
  EXPECT_NEAR(front.error_at(1).value(), 0.08, 1e-12);
  EXPECT_NEAR(front.error_at(400).value(), 0.02, 1e-12);
  EXPECT_FALSE(front.error_at(0.5).has_value());
}

TEST(AccuracyPage, SaysWhatToUseWithTheNumbersOfTheStudy) {
  const std::string page = accuracy_page(study_by_hand(), "plot.png");
  EXPECT_THAT(page, HasSubstr("room.glb"));
  EXPECT_THAT(page, HasSubstr("![error over CPU time](plot.png)"));
  EXPECT_THAT(page, HasSubstr("| 10 % | rays 64, spacing 4, 16 light samples, max 1000 patches | 8 % | 1 s |"));
  EXPECT_THAT(page, HasSubstr("| 5 % | rays 64, spacing 4, 16 light samples, max 1000 patches | 2 % | 4 s |"));
  EXPECT_THAT(page, HasSubstr("| 1 % | none of those swept | | |"));
  EXPECT_THAT(page, HasSubstr("| `--max-error 5%` | 2 | 4.5 % | 5 % | 2 s | 1 s | 4 % |"));
  // 0.05 over 0.04, and 0.09 over 0.1 is as far from 1 as 0.045 over 0.05.
  EXPECT_THAT(page, HasSubstr("at most 1.25 x the error"));
  EXPECT_THAT(page, HasSubstr("0.90 to 0.90 x the true error"));
  EXPECT_THAT(page, HasSubstr("64 (8 %, 1 s), 16 (16 %, 2 s), 256 (2 %, 4 s)"));
  EXPECT_THAT(page, HasSubstr("* rays 3: refused"));
}

TEST(AccuracyPage, CallsMethodsEqualThatEndAtOneError) {
  AccuracyStudy study = study_by_hand();
  study.runs = {fixed_run(AccuracyAxis::kSolver, "lu", 2, 0.0201), fixed_run(AccuracyAxis::kSolver, "krylov", 1, 0.02),
                fixed_run(AccuracyAxis::kFormFactors, "hemicube", 1, 0.06),
                fixed_run(AccuracyAxis::kFormFactors, "adaptive", 3, 0.02)};
  const std::string page = accuracy_page(study, "plot.png");
  EXPECT_THAT(page, HasSubstr("krylov (2 %, 1 s). All end at the same error; krylov is the cheapest."));
  EXPECT_THAT(page, HasSubstr("Most exact: adaptive; cheapest: hemicube; the largest error is 3.00 x the smallest."));
}

TEST(AccuracyTable, HasALineForEachBakeAndPass) {
  const std::string csv = accuracy_csv(study_by_hand());
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 3 + 2);
  EXPECT_THAT(csv, HasSubstr("\nrays,64,64,4,16,1000,auto,auto,,,0,1,0.5,0.08,0.08,0.08\n"));
  EXPECT_THAT(csv, HasSubstr("\nprogressive,,,,,,,,0.05,,1,2,1,0.05,0.05,0.045\n"));
}

TEST(AccuracyPlot, DrawsEveryBakeTheFrontAndWhatIsStated) {
  const Plot plot = accuracy_plot(study_by_hand());
  ASSERT_EQ(plot.panels.size(), 2U);
  const auto of = [&](std::size_t panel, const std::string& title) {
    for (const Curve& curve : plot.panels[panel].curves) {
      if (curve.title == title) return curve.points.size();
    }
    ADD_FAILURE() << title;
    return std::size_t{0};
  };
  EXPECT_EQ(of(0, "rays, every texel"), 3U);
  EXPECT_EQ(of(0, "progressive, by pass"), 2U);
  EXPECT_EQ(of(0, "Pareto front, fixed"), 2U);
  EXPECT_EQ(of(1, "fixed settings"), 3U);
}

TEST(StackedLightmaps, LeaveARowBetweenSheetsAndOtherLayersOut) {
  const std::vector<radiosity::Layer> layers = {{"lightmap_0", "", "", 1, 1, 4, {1, 2, 3, 4}},
                                                {"error_0", "", "", 1, 1, 4, {9, 9, 9, 9}},
                                                {"lightmap_0_direct", "", "", 1, 1, 4, {9, 9, 9, 9}},
                                                {"lightmap_1", "", "", 1, 1, 4, {5, 6, 7, 8}}};
  const image::Pixels stack = stacked_lightmaps(layers);
  EXPECT_EQ(stack.width, 1);
  EXPECT_EQ(stack.height, 3);
  EXPECT_THAT(stack.values, ElementsAre(1, 2, 3, 4, 0, 0, 0, 0, 5, 6, 7, 8));
}

/// Fine enough that patches are not what errors come from, and few enough for form factors by formula.
constexpr int kPatches = 1200;

/// Of a small room, without the minutes of the real sweep.
AccuracySweep small_sweep(std::vector<int> rays) {
  AccuracySweep sweep;
  sweep.base.texels_per_meter = 2;
  sweep.base.max_patches = kPatches;
  for (const int n : rays) {
    radiosity::BakeOptions options = sweep.base;
    options.rays = n;
    options.spacing = 1;
    sweep.settings.push_back({AccuracyAxis::kRays, std::to_string(n), options});
  }
  return sweep;
}

constexpr ReferenceEffort kSmallEffort{1024, 1024, kPatches};

TEST(AccuracyStudy, MeasuresErrorsThatFallWithRaysAgainstAReferenceWhoseErrorIsSmaller) {
  const Scene scene = tests::small_emitter_room(0.5);
  AccuracySweep sweep = small_sweep({16, 256});
  sweep.targets = {0.1};
  sweep.budgets = {0.2};
  AccuracyReference reference = make_reference(scene, sweep.base, kSmallEffort).value();
  EXPECT_GT(reference.error, 0);
  std::vector<std::string> told;
  const AccuracyStudy study =
      study_accuracy(scene, sweep, reference, [&](std::size_t done, std::size_t total, const std::string&) {
        told.push_back(std::to_string(done) + "/" + std::to_string(total));
      }).value();
  EXPECT_THAT(told, ElementsAre("0/4", "1/4", "2/4", "3/4"));
  ASSERT_EQ(study.runs.size(), 4U);
  const double coarse = study.runs[0].points.back().error, fine = study.runs[1].points.back().error;
  // 16 times the rays: a fourth of the error if they were independent, and half of it at the very least.
  EXPECT_LT(fine, coarse / 2);
  EXPECT_LT(reference.error, fine);
  for (const AccuracyRun& run : study.runs) {
    for (const AccuracyPoint& point : run.points) {
      EXPECT_NEAR(std::hypot(point.error, reference.error), point.difference, 1e-12);
      EXPECT_GT(point.cpu_seconds, 0);
    }
  }
  // The map of each pass is measured, and the last one is the bake's own.
  const AccuracyRun& progressive = study.runs[2];
  EXPECT_FALSE(progressive.setting.has_value());
  EXPECT_TRUE(std::is_sorted(progressive.points.begin(), progressive.points.end(),
                             [](const auto& a, const auto& b) { return a.cpu_seconds < b.cpu_seconds; }));
  EXPECT_LE(progressive.points.back().stated, 0.1);
  constexpr double kBusyMachine = 20;  // only that there is an end
  EXPECT_EQ(study.runs[3].budget, 0.2);
  EXPECT_LE(study.runs[3].points.back().seconds, kBusyMachine);
}

TEST(AccuracyStudy, TakesHemicubesForItsReferenceWhereLightPassesSurfaces) {
  const Scene opaque = tests::small_emitter_room(0.5);
  const AccuracySweep sweep = small_sweep({});
  EXPECT_THAT(make_reference(opaque, sweep.base, {64, 64, kPatches}).value().origin, HasSubstr("`adaptive`"));
  for (const tests::EffectRoom& room : tests::rooms_with_effects()) {
    if (room.name != "tint") continue;
    EXPECT_THAT(make_reference(room.scene, sweep.base, {64, 64, kPatches}).value().origin, HasSubstr("`hemicube`"));
  }
}

TEST(AccuracyStudy, LeavesOutWhatABakeRefusesAndFailsWhereThatIsAll) {
  const Scene scene = tests::small_emitter_room(0.5);
  const AccuracySweep sweep = small_sweep({3, 16});
  const AccuracyReference reference = make_reference(scene, sweep.base, {64, 64, kPatches}).value();
  const auto quiet = [](std::size_t, std::size_t, const std::string&) {};
  const AccuracyStudy study = study_accuracy(scene, sweep, reference, quiet).value();
  EXPECT_EQ(study.runs.size(), 1U);
  ASSERT_EQ(study.left_out.size(), 1U);
  EXPECT_THAT(study.left_out[0], HasSubstr("rays 3"));
  const auto refused = study_accuracy(scene, small_sweep({3}), reference, quiet);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("no setting could be baked"));
}

TEST(AccuracyStudy, LeavesOutWhatTakesTooLong) {
  const Scene scene = tests::small_emitter_room(0.5);
  AccuracySweep sweep = small_sweep({4096});
  sweep.budgets = {0.2};
  const AccuracyReference reference = make_reference(scene, sweep.base, {64, 64, kPatches}).value();
  sweep.bake_limit_seconds = 1e-3;
  const AccuracyStudy study =
      study_accuracy(scene, sweep, reference, [](std::size_t, std::size_t, const std::string&) {}).value();
  EXPECT_EQ(study.runs.size(), 1U);
  ASSERT_EQ(study.left_out.size(), 1U);
  EXPECT_THAT(study.left_out[0], HasSubstr("it took more than 0.001 s"));
}

TEST(AccuracyStudy, RefusesAReferenceOfAnotherSize) {
  const Scene scene = tests::small_emitter_room(0.5);
  AccuracyReference reference;
  reference.map = {2, 2, 4, std::vector<float>(16, 1.0F)};
  const auto refused =
      study_accuracy(scene, small_sweep({16}), reference, [](std::size_t, std::size_t, const std::string&) {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("the reference 2 x 2"));
}

TEST(DefaultSweep, VariesOneThingAtATimeAndKeepsWhatIsNotSwept) {
  radiosity::BakeOptions base;
  base.atlas_size = 256;
  base.rays = 7;
  base.max_error = 0.5;
  const AccuracySweep sweep = default_sweep(base);
  EXPECT_GE(sweep.settings.size(), 24U);
  EXPECT_EQ(sweep.base.atlas_size, 256);
  EXPECT_EQ(sweep.base.rays, 0);
  EXPECT_EQ(sweep.base.max_error, 0);
  EXPECT_THAT(sweep.targets, ElementsAre(0.1, 0.05, 0.02, 0.01));
  EXPECT_THAT(sweep.budgets, ElementsAre(1, 5, 20));
  for (const FixedSetting& setting : sweep.settings) {
    EXPECT_EQ(setting.options.atlas_size, 256);
    EXPECT_EQ(setting.options.max_error, 0);
    EXPECT_TRUE(radiosity::check_options(setting.options).ok()) << setting_words(setting.options);
  }
}

TEST(AccuracyCommand, SaysByItsExitWhatWentWrong) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(testing::TempDir()) / "accuracy_command";
  AccuracyChoices choices;
  choices.scene = {"/nowhere/room.glb", folder.string(), 0, {}};
  EXPECT_EQ(run_accuracy(choices), kBadInput);
  choices.scene.scene = RADBAKE_CORNELL_BOX;
  choices.reference = "/nowhere/reference.exr";
  EXPECT_EQ(run_accuracy(choices), kBadInput);
}

}  // namespace
}  // namespace radbake::study
