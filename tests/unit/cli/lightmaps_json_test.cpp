#include "client/cli/lightmaps_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Fixture {
  gltf::GltfScene scene;
  MeshResults results;
  LightmapFiles lightmap;
  std::vector<LightmapFiles> extra_layers;
  FileChoices files;

  Fixture() {
    scene.scene.meshes.resize(3);
    scene.sources = {{4, 0, 0}, {4, 0, 1}, {7, 2, 0}};
    results.meshes.resize(3);
    results.uv_sources = {v1::UV_PLACED, v1::UV_NONE, v1::UV_UNWRAPPED};
    results.meshes[0].lightmap = 0;
    results.meshes[0].uv_scale = {0.5, 0.25};
    results.meshes[0].uv_offset = {0.5, 0.75};
    results.meshes[2].lightmap = 0;
    lightmap.layer.set_name("lightmap_0");
    lightmap.layer.set_width(256);
    lightmap.layer.set_height(128);
    lightmap.layer.set_quantity("irradiance");
    lightmap.layer.set_unit("lx");
    lightmap.max_irradiance = lightmap.intensity = 1234.5;
  }

  Json json() const {
    return make_lightmaps_json({lightmap}, extra_layers, files, scene, {"", "", "", "", "floor", "", "", "caf\xC3\xA9"},
                               results);
  }
};

TEST(LightmapsJson, SaysWhichPrimitiveLiesWhere) {
  const Json json = Fixture().json();
  ASSERT_EQ(json["meshes"].size(), 2u);  // what lies nowhere is not in the list
  EXPECT_EQ(json["meshes"][0].dump(),
            R"({"node":4,"node_name":"floor","mesh":0,"primitive":0,"lightmap":0,"file":"lightmap_0.exr",)"
            R"("scale":[0.5,0.25],"offset":[0.5,0.75],"uv_set":1,"uv_source":"placed","has_vertex_light":false})");
  EXPECT_EQ(json["meshes"][1]["node_name"], "caf\xC3\xA9");
  EXPECT_EQ(json["meshes"][1]["uv_source"], "unwrapped");
  EXPECT_EQ(json["uv_origin"], "top left");
  EXPECT_FALSE(json.contains("vertices"));
}

TEST(LightmapsJson, SaysWhatTheNumbersInEachFileMean) {
  Fixture fixture;
  fixture.files.encodings = {Encoding::kRgbmPng, Encoding::kHdr, Encoding::kExr};
  const Json json = fixture.json();
  const Json& map = json["lightmaps"][0];
  EXPECT_EQ(map["width"], 256);
  EXPECT_EQ(map["height"], 128);
  EXPECT_EQ(map["quantity"], "irradiance");
  EXPECT_EQ(map["unit"], "lx");
  EXPECT_EQ(map["files"][0].dump(), R"({"file":"lightmap_0_rgbm.png","encoding":"png-rgbm","bits":"uint8",)"
                                    R"("multiplier":1234.5,"colour_space":"linear Rec.709"})");
  EXPECT_EQ(map["files"][1]["file"], "lightmap_0.hdr");
  EXPECT_EQ(map["files"][2]["encoding"], "exr");
  EXPECT_EQ(map["moz_lightmap"]["intensity"], 1234.5);
  EXPECT_EQ(json["meshes"][0]["file"], "lightmap_0_rgbm.png");  // the first that was asked for
}

TEST(LightmapsJson, ListsTheLayersThatShareALayout) {
  Fixture fixture;
  EXPECT_FALSE(fixture.json()["lightmaps"][0].contains("layers"));
  for (const char* name : {"lightmap_0_direct", "lightmap_0_ao", "lightmap_01_ao"}) {
    fixture.extra_layers.push_back(fixture.lightmap);
    fixture.extra_layers.back().layer.set_name(name);
  }
  fixture.extra_layers[1].layer.set_quantity("openness");
  fixture.extra_layers[1].layer.set_unit("1");
  fixture.extra_layers[1].max_irradiance = 1;
  const Json layers = fixture.json()["lightmaps"][0]["layers"];
  ASSERT_EQ(layers.size(), 2u);  // another lightmap's is not among them
  EXPECT_EQ(layers[0]["name"], "lightmap_0_direct");
  EXPECT_EQ(layers[0]["unit"], "lx");
  EXPECT_EQ(layers[1].dump(), R"({"name":"lightmap_0_ao","quantity":"openness","unit":"1","maximum":1.0,)"
                              R"("files":[{"file":"lightmap_0_ao.exr","encoding":"exr","bits":"float32",)"
                              R"("colour_space":"linear Rec.709"}]})");
}

TEST(LightmapsJson, ListsTheStandardErrorsOfALightmapAsFloats) {
  Fixture fixture;
  fixture.files.encodings = {Encoding::kRgbmPng, Encoding::kExr};
  for (const char* name : {"error_0", "error_01"}) {
    fixture.extra_layers.push_back(fixture.lightmap);
    fixture.extra_layers.back().layer.set_name(name);
    fixture.extra_layers.back().layer.set_quantity("standard_error");
    fixture.extra_layers.back().max_irradiance = 2.5;
  }
  const Json layers = fixture.json()["lightmaps"][0]["layers"];
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].dump(), R"({"name":"error_0","quantity":"standard_error","unit":"lx","maximum":2.5,)"
                              R"("files":[{"file":"error_0.exr","encoding":"exr","bits":"float32",)"
                              R"("colour_space":"linear Rec.709"}]})");
}

TEST(LightmapsJson, DescribesLightByVertexWhereThereIsAny) {
  Fixture fixture;
  fixture.results.uv_sources[0] = v1::UV_NONE;
  fixture.results.meshes[0] = {};
  fixture.results.meshes[0].irradiance = {{1, 2, 3}};
  fixture.results.max_irradiance = 3;
  EXPECT_EQ(fixture.json()["vertices"].dump(),
            R"({"attribute":"_IRRADIANCE","quantity":"irradiance","unit":"lx","colour_space":"linear Rec.709",)"
            R"("maximum":3.0})");
  EXPECT_EQ(fixture.json()["meshes"][0].dump(),
            R"({"node":4,"node_name":"floor","mesh":0,"primitive":0,"has_vertex_light":true})");
  fixture.files.vertex_colors = true;
  EXPECT_EQ(fixture.json()["vertices"]["color_attribute"], "COLOR_0");
}

}  // namespace
}  // namespace radbake::cli
