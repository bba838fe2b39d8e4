#include "client/cli/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/cli/proto_json.h"

namespace radbake::cli {
namespace {

v1::Bake finished_bake() {
  v1::Bake bake;
  bake.set_name("bakes/1");
  bake.set_label("scene.glb");
  bake.set_attempt(1);
  v1::BakeReport& report = *bake.mutable_result()->mutable_report();
  report.set_engine_version("1.2.3");
  report.mutable_plan()->set_num_patches(10);
  report.mutable_solver()->set_status("converged");
  report.mutable_run()->set_host("here");
  v1::Warning& warning = *report.add_warnings();
  warning.set_id("buried");
  warning.set_text("3 texels are buried");
  return bake;
}

TEST(Report, HoldsTheServersAndTheClientsPart) {
  SceneReport scene;
  scene.num_triangles_dropped = 4;
  scene.warnings = {{"reflectance_limited", "material 'white' was limited"}};
  scene.mesh_transfer.set_position_bits(18);
  v1::Layer layer;
  layer.set_name("lightmap_0");
  v1::StageSeconds stage;
  stage.set_stage("read");
  const auto report = make_report(finished_bake(), {{layer, "lightmap_0.exr", "lightmap_0.png"}}, scene, {stage});
  EXPECT_EQ(report["engine_version"], "1.2.3");
  EXPECT_EQ(report["scene"]["name"], "scene.glb");
  EXPECT_EQ(report["scene"]["num_triangles_dropped"], 4);
  EXPECT_EQ(report["scene"]["mesh_transfer"]["position_bits"], 18);
  EXPECT_EQ(report["layers"][0]["name"], "lightmap_0");
  EXPECT_EQ(report["layers"][0]["image"], "lightmap_0.exr");
  EXPECT_EQ(report["plan"]["num_patches"], 10);
  EXPECT_EQ(report["solver"]["status"], "converged");
  EXPECT_EQ(report["warnings"][0]["id"], "reflectance_limited");
  EXPECT_EQ(report["warnings"][1]["id"], "buried");
  EXPECT_EQ(report["run"]["host"], "here");
  EXPECT_EQ(report["run"]["job"], "bakes/1");
  EXPECT_EQ(report["run"]["client"]["stages"][0]["stage"], "read");
}

TEST(Report, KeepsAllThatMayDifferBetweenEqualRunsUnderItsLastKey) {
  v1::Bake one = finished_bake(), other = finished_bake();
  other.set_name("bakes/2");
  other.set_attempt(3);
  other.set_created_unix_ms(12345);
  other.mutable_result()->mutable_report()->mutable_run()->set_wall_seconds(99);
  v1::StageSeconds slow;
  slow.set_seconds(7);
  auto first = make_report(one, {}, SceneReport(), {});
  auto second = make_report(other, {}, SceneReport(), {slow});
  EXPECT_NE(first, second);
  EXPECT_EQ(std::prev(first.end()).key(), "run");
  first.erase("run");
  second.erase("run");
  EXPECT_EQ(to_text(first), to_text(second));
}

TEST(Report, HoldsWhatWasPredictedAmongWhatMayDiffer) {
  v1::Bake bake = finished_bake();
  EXPECT_FALSE(make_report(bake, {}, std::nullopt, {})["run"].contains("predicted_and_actual"));
  v1::RunReport& run = *bake.mutable_result()->mutable_report()->mutable_run();
  run.set_cpu_seconds(3);
  run.mutable_prediction()->mutable_total()->set_cpu_seconds(2);
  const auto report = make_report(bake, {}, std::nullopt, {});
  EXPECT_EQ(report["run"]["predicted_and_actual"]["total"]["predicted_cpu_seconds"], 2);
  EXPECT_EQ(report["run"]["predicted_and_actual"]["total"]["actual_cpu_seconds"], 3);
  EXPECT_FALSE(report["plan"].contains("prediction"));
}

TEST(Report, HoldsTheErrorAndThePasses) {
  v1::Bake bake = finished_bake();
  EXPECT_FALSE(make_report(bake, {}, std::nullopt, {}).contains("error"));
  v1::BakeReport& server = *bake.mutable_result()->mutable_report();
  server.mutable_error()->set_relative_rmse(0.03);
  server.add_passes()->set_rays_per_texel(64);
  server.mutable_run()->add_passes()->set_seconds(0.25);
  const auto report = make_report(bake, {}, std::nullopt, {});
  EXPECT_EQ(report["error"]["relative_rmse"], 0.03);
  EXPECT_TRUE(report["error"]["asked"].is_null());
  EXPECT_EQ(report["passes"][0]["rays_per_texel"], 64);
  EXPECT_FALSE(report["passes"][0].contains("seconds"));  // equal bakes have equal passes
  EXPECT_EQ(report["run"]["passes"][0]["seconds"], 0.25);
}

TEST(Report, NamesNoPreviewWhereThereIsNone) {
  v1::Layer layer;
  const auto report = make_report(finished_bake(), {{layer, "error_0.exr", ""}}, std::nullopt, {});
  EXPECT_EQ(report["layers"][0]["image"], "error_0.exr");
  EXPECT_FALSE(report["layers"][0].contains("preview"));
}

TEST(Report, OfADownloadHasNoReadersPart) {
  const auto report = make_report(finished_bake(), {}, std::nullopt, {});
  EXPECT_FALSE(report["scene"].contains("num_triangles_dropped"));
  EXPECT_EQ(report["scene"]["name"], "scene.glb");
}

}  // namespace
}  // namespace radbake::cli
