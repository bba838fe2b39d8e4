#include "client/cli/proto_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "radbake/v1/bake.pb.h"

namespace radbake::cli {
namespace {

TEST(ProtoJson, KeepsTheOrderAndTheNamesOfTheFields) {
  v1::SolverReport solver;
  solver.set_status("converged");
  solver.set_solver("gauss-seidel");
  solver.set_sweeps(12);
  solver.set_residual(0.5);
  EXPECT_EQ(to_line(to_json(solver)),
            R"({"solver":"gauss-seidel","status":"converged","sweeps":12,"residual":0.5,"error_bound":0.0,)"
            R"("relative_error_bound":0.0,"tolerance":0.0,"history":[]})");
}

TEST(ProtoJson, WritesLargeIntegersAsNumbers) {
  v1::Digest digest;
  digest.set_size_bytes(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(to_line(to_json(digest)), R"({"sha256":"","size_bytes":18446744073709551615})");
}

TEST(ProtoJson, WritesNoNumberThatJsonDoesNotHave) {
  v1::EnergyAudit audit;
  audit.set_emitted(std::numeric_limits<double>::quiet_NaN());
  audit.set_gap(-std::numeric_limits<double>::infinity());
  const auto json = to_json(audit);
  EXPECT_TRUE(json["emitted"].is_null());
  EXPECT_TRUE(json["gap"].is_null());
  EXPECT_EQ(json["is_closed"], false);
}

TEST(ProtoJson, NamesEnumsAndLeavesOutMessagesThatAreNotSet) {
  v1::Bake bake;
  bake.set_state(v1::GATHERING);
  const auto json = to_json(bake);
  EXPECT_EQ(json["state"], "GATHERING");
  EXPECT_FALSE(json.contains("result"));
  EXPECT_FALSE(json.contains("error"));
  EXPECT_EQ(json["label"], "");
}

TEST(ProtoJson, ShowsAnEnumValueOfANewerServerAsItsNumber) {
  v1::Bake bake;
  bake.set_state(static_cast<v1::BakeState>(77));
  EXPECT_EQ(to_json(bake)["state"], 77);
}

TEST(ProtoJson, ShowsTheOneMemberOfAOneofThatIsSet) {
  v1::WatchBakeResponse response;
  response.mutable_progress()->set_fraction(0.25);
  const auto json = to_json(response);
  EXPECT_EQ(json.size(), 1u);
  EXPECT_EQ(json["progress"]["fraction"], 0.25);
}

TEST(ProtoJson, ListsRepeatedMessagesAndLeavesOutBytes) {
  v1::BakeResult result;
  result.add_layers()->set_name("lightmap_0");
  result.add_layers()->set_name("lightmap_1");
  EXPECT_EQ(to_json(result)["layers"][1]["name"], "lightmap_1");
  v1::LayerTile tile;
  tile.set_data("pixels");
  EXPECT_FALSE(to_json(tile).contains("data"));
}

TEST(ProtoJson, ReplacesBytesThatAreNoText) {
  EXPECT_EQ(to_utf8("caf\xe9.glb"), "caf\xef\xbf\xbd.glb");
  EXPECT_EQ(to_utf8("café.glb"), "café.glb");
}

}  // namespace
}  // namespace radbake::cli
