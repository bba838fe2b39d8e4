#include "server/worker/result_messages.h"

#include <gmock/gmock.h>
#include <grpcpp/support/status_code_enum.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "server/settings/to_options.h"
#include "server/worker/status_message.h"
#include "tests/unit/unset_fields.h"

namespace radbake::worker {
namespace {

radiosity::BakePlan full_plan() {
  radiosity::BakePlan plan;
  plan.survey = {1,    2,    3,    4,    5,  6,    7,    8,    9,    10.5, 11.5, 0.5,  13.5, true, 0.25, 16,      true,
                 true, true, 0.75, 0.01, 22, 23.5, 24.5, 25.5, 26.5, 27.5, 28.5, 29.5, 30.5, 31,   32.5, {"lamp"}};
  plan.atlas_size = 14;
  plan.num_texels = 15;
  plan.num_patches = 16;
  plan.rays_per_texel = 17;
  plan.rays_per_row = 18;
  plan.light_samples_per_texel = 19;
  plan.form_factors = radiosity::FormFactors::kAdaptive;
  plan.transport = radiosity::Transport::kStreamed;
  plan.solver = radiosity::Solver::kShooting;
  plan.transport_bytes = 24;
  plan.transport_bytes_limit = 25;
  plan.texels_per_meter = 20.5;
  plan.atlas_height = 21;
  plan.num_lightmaps = 22;
  plan.num_vertex_groups = 23;
  plan.effects = {{radiosity::Effect::kSun, radiosity::EffectState::kUnsupported, "why", 26.5, true}};
  plan.num_channels = 1;
  plan.form_factors_reason = "of the rows";
  plan.transport_reason = "of the operator";
  plan.solver_reason = "of the solver";
  plan.warnings = {{"plan_warning", "of the plan"}};
  return plan;
}

TEST(ResultMessages, SetEveryFieldOfAPlan) {
  const v1::Plan plan = to_message(full_plan());
  EXPECT_THAT(unset_fields(plan), ::testing::ElementsAre("prediction"));
  EXPECT_EQ(plan.survey().num_instances(), 16U);
  EXPECT_EQ(plan.survey().escape_share(), 0.75);
  EXPECT_EQ(plan.survey().area_volume_m2(), 30.5);
  EXPECT_EQ(plan.survey().lamp_lumens(), 32.5);
  EXPECT_EQ(plan.effects(0).effect(), "sun");
  EXPECT_EQ(plan.effects(0).state(), "unsupported");
  EXPECT_EQ(plan.effects(0).value(), 26.5);
  EXPECT_EQ(plan.num_channels(), 1U);
  EXPECT_EQ(plan.estimator_reason(), "of the rows");
  EXPECT_EQ(plan.solver_reason(), "of the solver");
  EXPECT_EQ(plan.survey().num_glowing_triangles(), 9U);
  EXPECT_EQ(plan.survey().extent_m(), 13.5);
  EXPECT_EQ(plan.rays_per_texel(), 17U);
  EXPECT_EQ(plan.rays_per_row(), 18U);
  EXPECT_EQ(plan.light_samples_per_texel(), 19U);
  EXPECT_EQ(plan.warnings(0).id(), "plan_warning");
  EXPECT_EQ(plan.estimator(), "adaptive");
  EXPECT_EQ(plan.transport(), "streamed");
  EXPECT_EQ(plan.solver(), "shooting");
}

TEST(ResultMessages, SetEveryFieldOfAPredictionAndOfCosts) {
  radiosity::Prediction prediction;
  prediction.stages = {{"gathering", 1.5, 2.5, 3.5, 4.5, 5}};
  prediction.total = {"total", 6.5, 7.5, 8.5, 9.5, 10};
  prediction.costliest = {{"vase", 11.5, 12, 13}};
  prediction.effects = {{radiosity::Effect::kOcclusion, 14.5}};
  prediction.source = "pilot";
  prediction.pilot_seconds = 15.5;
  const v1::Prediction message = to_message(prediction);
  EXPECT_THAT(unset_fields(message), ::testing::IsEmpty());
  EXPECT_EQ(message.stages(0).cpu_seconds_high(), 3.5);
  EXPECT_EQ(message.total().memory_bytes(), 10U);
  EXPECT_EQ(message.costliest(0).num_patches(), 13U);
  EXPECT_EQ(message.effects(0).effect(), "occlusion");

  // There and back.
  const v1::HostCosts costs = to_message(radiosity::HostCosts{1, 2, 3, 4, 5, 6, 7});
  EXPECT_THAT(unset_fields(costs), ::testing::IsEmpty());
  EXPECT_EQ(to_message(settings::to_costs(costs)).SerializeAsString(), costs.SerializeAsString());
  EXPECT_EQ(costs.light_ray(), 3);
  EXPECT_EQ(costs.entry(), 7);
}

TEST(ResultMessages, SetEveryFieldOfAReportButTheWorkersOwn) {
  radiosity::BakeReport report;
  report.instruction_set = "avx2";
  report.plan = full_plan();
  report.num_patches = 21;
  report.num_row_rays = 22;
  report.num_gather_rays = 23;
  report.num_light_rays = 24;
  report.solver = {"gauss-seidel", "converged", 25, 26.5, 27.5, 28.5, 29.5, {{1, 2, 3.5, 4.5}}};
  report.energy = {true, 30.5, 31.5, 32.5, 33.5, 34.5, 35.5, 36.5};
  report.transport = {37, 38.5, 39.5, 40.5, 41.5, 42, 43.5, 44.5, 45.5, 46};
  report.lightmap = {45, 46, 47, 48, 49.5, 50, 51, 52.5, 53, 54, 55, 56, 57.5, 58, 59.5, 60.5};
  report.vertices = {61, 62, 63};
  report.error.relative_rmse = 64.5;
  report.error.interval_low = 65.5;
  report.error.interval_high = 66.5;
  report.error.algebraic = 67.5;
  report.error.sampling = 68.5;
  report.error.discretisation = 69.5;
  report.error.worst = {70.5, 71, 72, 73, "wall"};
  report.error.asked = 74.5;
  report.error.predicted = 75.5;
  report.error.is_reached = true;
  report.error.limited_by = "time";
  report.error.num_texels = 76;
  report.passes = {{77, 78, 79, 80, 81, 82, 83, 84, 85.5, 86.5, 87.5, {90.5, 91.5, true, 92.5}, false, 88.5, 89.5}};
  report.warnings = {{"bake_warning", "of the bake"}};
  const v1::BakeReport message = to_message(report);
  EXPECT_THAT(unset_fields(message), ::testing::UnorderedElementsAre("plan.prediction", "engine_version", "run"));
  EXPECT_EQ(message.num_light_rays(), 24U);
  EXPECT_EQ(message.solver().sweeps(), 25U);
  EXPECT_EQ(message.solver().tolerance(), 29.5);
  EXPECT_EQ(message.solver().history(0).rows(), 2U);
  EXPECT_EQ(message.solver().history(0).relative_error_bound(), 4.5);
  EXPECT_EQ(message.energy().emitted(), 30.5);
  EXPECT_EQ(message.energy().mean_irradiance(), 36.5);
  EXPECT_EQ(message.transport().num_entries(), 37U);
  EXPECT_EQ(message.transport().absorbed_share(), 44.5);
  EXPECT_EQ(message.lightmap().num_texels_dilated(), 48U);
  EXPECT_EQ(message.lightmap().num_meshes_unwrapped(), 55U);
  EXPECT_EQ(message.lightmap().seam_difference(), 60.5);
  EXPECT_EQ(message.vertices().num_copies(), 63U);
  EXPECT_EQ(message.error().relative_rmse(), 64.5);
  EXPECT_EQ(message.error().interval_low(), 65.5);
  EXPECT_EQ(message.error().interval_high(), 66.5);
  EXPECT_EQ(message.error().algebraic(), 67.5);
  EXPECT_EQ(message.error().sampling(), 68.5);
  EXPECT_EQ(message.error().discretisation(), 69.5);
  EXPECT_EQ(message.error().worst_1_percent().error(), 70.5);
  EXPECT_EQ(message.error().worst_1_percent().lightmap(), 71U);
  EXPECT_EQ(message.error().worst_1_percent().y(), 73U);
  EXPECT_EQ(message.error().worst_1_percent().mesh(), "wall");
  EXPECT_EQ(message.error().asked(), 74.5);
  EXPECT_EQ(message.error().predicted(), 75.5);
  EXPECT_EQ(message.error().limited_by(), "time");
  EXPECT_EQ(message.error().num_texels(), 76U);
  EXPECT_EQ(message.passes(0).num_patches(), 77U);
  EXPECT_EQ(message.passes(0).rays_per_texel(), 79U);
  EXPECT_EQ(message.passes(0).num_gather_rays(), 83U);
  EXPECT_EQ(message.passes(0).interval_high(), 87.5);
  EXPECT_EQ(message.passes(0).gathered_scale(), 90.5);
  EXPECT_EQ(message.passes(0).direct_scale(), 91.5);
  EXPECT_EQ(message.passes(0).interpolation_limit(), 92.5);
  EXPECT_EQ(message.warnings(0).text(), "of the bake");
  // Without a lightmap there are no texels to be wrong.
  report.error = {};
  EXPECT_FALSE(to_message(report).has_error());
}

TEST(ResultMessages, SetEveryFieldOfProgressTileAndLayer) {
  radiosity::BakeProgress progress{radiosity::BakeStage::kSolving, 0.5, 3, 4, 5.5, 6.5, 7, 8.5, 9.5, 10.5, 11.5};
  EXPECT_THAT(unset_fields(to_message(progress)), ::testing::IsEmpty());
  EXPECT_EQ(to_message(progress).state(), v1::SOLVING);
  EXPECT_EQ(to_message(progress).seconds_left(), 5.5);
  EXPECT_EQ(to_message(progress).pass(), 7U);
  EXPECT_EQ(to_message(progress).relative_error(), 8.5);
  EXPECT_EQ(to_message(progress).relative_error_low(), 9.5);
  EXPECT_EQ(to_message(progress).relative_error_high(), 10.5);
  EXPECT_EQ(to_message(progress).asked_error(), 11.5);

  radiosity::Tile tile{1, 2, 3, 4, 2, 1, 4, {0, 1, 2, 3, 4, 5, 6, 7}};
  tile.layer_name = "lightmap_1";
  tile.layer_width = 64;
  tile.layer_height = 32;
  const v1::LayerTile message = to_message(tile);
  EXPECT_THAT(unset_fields(message), ::testing::IsEmpty());
  EXPECT_EQ(message.pass(), 2U);
  EXPECT_EQ(message.x(), 3U);
  EXPECT_EQ(message.layer_height(), 32U);
  EXPECT_EQ(message.data().size(), 32U);

  const radiosity::Layer layer{"lightmap_0", "irradiance", "lx", 64, 32, 4, {}};
  EXPECT_THAT(unset_fields(to_message(layer)), ::testing::ElementsAre("blob"));
  EXPECT_EQ(to_message(layer).height(), 32U);
}

TEST(ResultMessages, LayAMeshsDataAfterThatOfTheMeshesBeforeIt) {
  radiosity::MeshOutput mesh;
  mesh.placement = {radiosity::UvSource::kUnwrapped, 2, {0.5, 0.25}, {0.125, 0.75}};
  mesh.num_vertices = 4;
  mesh.source_vertices = {0, 1, 2, 0};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}};
  mesh.uvs = {{0.1f, 0.2f}, {0.3f, 0.4f}, {0.5f, 0.6f}, {0.7f, 0.8f}};
  mesh.irradiance = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
  std::string data = "12345678";
  const v1::MeshResult message = to_message(mesh, data);
  EXPECT_THAT(unset_fields(message), ::testing::IsEmpty());
  EXPECT_EQ(message.uv_source(), v1::UV_UNWRAPPED);
  EXPECT_EQ(message.uv_scale().y(), 0.25);
  EXPECT_EQ(message.uv_offset().x(), 0.125);
  EXPECT_EQ(message.data_offset(), 8U);
  ASSERT_EQ(data.size(), 8 + 4 * 4 + 2 * 12 + 4 * 8 + 4 * 12U);
  std::uint32_t corner = 0;
  std::memcpy(&corner, data.data() + 8 + 4 * 4 + 3 * 4, 4);
  EXPECT_EQ(corner, 3U);
  float value = 0;
  std::memcpy(&value, data.data() + data.size() - 4, 4);
  EXPECT_EQ(value, 12);
}

TEST(StatusMessage, HasTheCodeOfTheSameName) {
  const auto code_of = [](ErrorCode code) { return to_message(Error{code, "text"}).code(); };
  EXPECT_EQ(code_of(ErrorCode::kInvalidArgument), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code_of(ErrorCode::kNotFound), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(code_of(ErrorCode::kAlreadyExists), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(code_of(ErrorCode::kFailedPrecondition), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(code_of(ErrorCode::kResourceExhausted), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(code_of(ErrorCode::kDataLoss), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(code_of(ErrorCode::kUnavailable), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(code_of(ErrorCode::kCancelled), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(code_of(ErrorCode::kInternal), grpc::StatusCode::INTERNAL);
  EXPECT_EQ(to_message(Error{ErrorCode::kInternal, "text"}).message(), "text");
}

}  // namespace
}  // namespace radbake::worker
