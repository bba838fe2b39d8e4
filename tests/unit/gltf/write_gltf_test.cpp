// What the file says beside its geometry, and who gets which lightmap.
#include "client/gltf/write_gltf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gltf/write_support.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A square whose own TEXCOORD_1 is x and y.
GltfBuilder mapped_square() {
  GltfBuilder file = square();
  const int uvs = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = uvs;
  return file;
}

void in_lightmap_0(const Scene&, std::vector<BakedMesh>& baked) {
  for (BakedMesh& mesh : baked) mesh.lightmap = 0;
}

TEST(WriteGltf, KeepsEverythingThatItDoesNotKnow) {
  GltfBuilder file = mapped_square();
  const int times = file.add_floats({0, 1}, "VEC2");
  file.document["asset"]["copyright"] = "somebody, \xC3\xA9t\xC3\xA9";
  file.document["extensionsUsed"] = {"EXT_of_tomorrow"};
  file.document["extensions"]["EXT_of_tomorrow"] = {{"list", {1, 2.5, "three", nullptr, true}}, {"tiny", 1e-300}};
  file.document["extras"] = {{"deep", {{"deeper", json::array({json::object()})}}}};
  file.document["animations"] = json::array({{{"samplers", {{{"input", times}, {"output", times}}}},
                                              {"channels", {{{"sampler", 0}, {"target", {{"path", "weights"}}}}}}}});
  file.document["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.1}, {"znear", 1}}}}});
  file.document["materials"][0]["extras"] = {{"texCoord", 1}};
  file.document["nodes"][0]["extras"] = 7;
  file.document["meshes"][0]["extras"]["targetNames"] = {"smile"};
  const Written written = write_baked(file.glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  for (const char* key : {"asset", "extensions", "extras", "animations", "cameras", "nodes", "scenes", "scene"}) {
    EXPECT_EQ(written.document.at(key).dump(), ordered_json(file.document.at(key)).dump()) << key;
  }
  EXPECT_EQ(written.document["meshes"][0]["extras"].dump(), R"({"targetNames":["smile"]})");
  EXPECT_EQ(written.document["materials"][0]["extras"].dump(), R"({"texCoord":1})");
  EXPECT_THAT(written.document["extensionsUsed"], ElementsAre("EXT_of_tomorrow", "MOZ_lightmap"));
  // What the animation needs is where it was.
  EXPECT_THAT(written.floats(times), ElementsAre(0, 1));
}

TEST(WriteGltf, BringsLightProfilesOfOtherFilesIn) {
  const std::string profile = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 1 0 0 0 1 1 1\n0 90\n0\n5 7\n";
  GltfBuilder file = mapped_square();
  file.document["extensions"]["EXT_lights_ies"]["lights"] =
      json::array({{{"uri", "my%20lamp.ies"}, {"name", "lamp"}}, {{"uri", "my%20lamp.ies"}}, {{"uri", "missing.ies"}}});
  for (const int light : {0, 1}) file.add_root({{"extensions", {{"EXT_lights_ies", {{"light", light}}}}}});
  const Written written = write_baked(file.glb(), in_lightmap_0, {}, "scene.glb", {{"my lamp.ies", profile}});
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& lights = written.document["extensions"]["EXT_lights_ies"]["lights"];
  EXPECT_EQ(lights[0]["name"], "lamp");
  for (const int light : {0, 1}) {
    EXPECT_FALSE(lights[light].contains("uri"));
    EXPECT_EQ(lights[light]["mimeType"], "application/x-ies-lm-63");
    const ordered_json& view = written.document["bufferViews"][lights[light]["bufferView"].get<std::size_t>()];
    EXPECT_EQ(written.bin.substr(view["byteOffset"], view["byteLength"]), profile);
  }
  EXPECT_EQ(lights[0]["bufferView"], lights[1]["bufferView"]);
  EXPECT_EQ(lights[2].dump(), R"({"uri":"missing.ies"})");
  ASSERT_EQ(written.after.scene.lights.size(), 2u);
  EXPECT_EQ(std::get<ProfileLight>(written.after.scene.lights[1].kind).profile->candela, (std::vector<float>{5, 7}));
}

TEST(WriteGltf, AttachesALightmapToTheMaterialAndKeepsAnOwnLayout) {
  const Written written = write_baked(mapped_square().glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& extension = written.document["materials"][0]["extensions"]["MOZ_lightmap"];
  EXPECT_EQ(extension.dump(), R"({"index":0,"texCoord":1,"intensity":10.0})");
  const ordered_json& image = written.document["images"][0];
  EXPECT_EQ(image["name"], "lightmap_0");
  EXPECT_EQ(image["mimeType"], "image/png");
  const ordered_json& view = written.document["bufferViews"][image["bufferView"].get<std::size_t>()];
  EXPECT_EQ(written.bin.substr(view["byteOffset"], view["byteLength"]), "\x89PNG of lightmap_0");
  EXPECT_EQ(written.document["samplers"][written.document["textures"][0]["sampler"].get<std::size_t>()]["wrapS"],
            33071);
  // Scale 1 and offset 0: not a byte of the geometry is new; TEXCOORDs are counted from 0.
  EXPECT_EQ(written.primitive(0)["attributes"].dump(), R"({"POSITION":0,"TEXCOORD_1":2,"TEXCOORD_0":2})");
  EXPECT_EQ(written.document["accessors"].size(), 3u);
}

TEST(WriteGltf, PlacesAnOwnLayoutInItsRectangleAndKeepsTheOldOne) {
  const auto place = [](const Scene&, std::vector<BakedMesh>& baked) {
    baked[0].lightmap = 0;
    baked[0].uv_scale = {0.5, 0.25};
    baked[0].uv_offset = {0.125, 0.5};
  };
  const Written written = write_baked(mapped_square().glb(), place);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& attributes = written.primitive(0)["attributes"];
  EXPECT_THAT(written.floats(attributes["TEXCOORD_1"]), ElementsAre(0.125, 0.5, 0.625, 0.5, 0.625, 0.75, 0.125, 0.75));
  EXPECT_EQ(attributes["TEXCOORD_2"], 2);
  EXPECT_EQ(attributes["POSITION"], 0);
  EXPECT_EQ(written.primitive(0)["indices"], 1);
}

TEST(WriteGltf, SendsTexturesToWhereTheirCoordinatesWent) {
  GltfBuilder file = mapped_square();
  file.add("images", {{"uri", "data:application/octet-stream;base64,MSAxIDMgMSAxIDE="}});  // 1 1 3 1 1 1
  file.add("textures", {{"source", 0}});
  json& material = file.document["materials"][0];
  material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
  material["normalTexture"] = {{"index", 0}, {"texCoord", 0}};
  material["extensions"]["EXT_of_tomorrow"]["someTexture"] = {{"index", 0}, {"texCoord", 1}};
  const auto place = [](const Scene&, std::vector<BakedMesh>& baked) {
    baked[0].lightmap = 0;
    baked[0].uv_scale = {0.5, 0.5};
  };
  const Written written = write_baked(file.glb(), place);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& after = written.document["materials"][0];
  EXPECT_EQ(after["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"], 2);
  EXPECT_EQ(after["extensions"]["EXT_of_tomorrow"]["someTexture"]["texCoord"], 2);
  EXPECT_EQ(after["normalTexture"]["texCoord"], 0);
  EXPECT_EQ(after["extensions"]["MOZ_lightmap"]["texCoord"], 1);
  EXPECT_EQ(written.primitive(0)["attributes"]["TEXCOORD_2"], 2);
}

TEST(WriteGltf, MovesDisplacementsWithTheCoordinatesThatTheyMove) {
  GltfBuilder file = mapped_square();
  const int moves = file.add_floats({0, 0, 0.5, 0, 0, 0, 0, 0}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["targets"] = json::array({{{"TEXCOORD_1", moves}}});
  const auto place = [](const Scene&, std::vector<BakedMesh>& baked) {
    baked[0].lightmap = 0;
    baked[0].uv_scale = {0.5, 0.5};
  };
  const Written written = write_baked(file.glb(), place);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.primitive(0)["targets"].dump(), "[{\"TEXCOORD_2\":" + std::to_string(moves) + "}]");
}

TEST(WriteGltf, GivesInstancesOwnMeshesAndMaterialsWhereTheirLightDiffers) {
  GltfBuilder file = mapped_square();
  file.add_root({{"mesh", 0}, {"translation", {5, 0, 0}}});
  file.add_root({{"mesh", 0}, {"translation", {0, 5, 0}}});
  const auto bake = [](const Scene&, std::vector<BakedMesh>& baked) {
    ASSERT_EQ(baked.size(), 3u);
    for (int i = 0; i < 3; ++i) {
      baked[i].lightmap = i / 2;
      baked[i].uv_scale = {0.5, 0.5};
      baked[i].uv_offset = {0.5 * (i % 2), 0};
    }
  };
  const Written written = write_baked(file.glb(), bake);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  ASSERT_EQ(written.document["meshes"].size(), 3u);
  ASSERT_EQ(written.document["materials"].size(), 2u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(written.document["nodes"][i]["mesh"], i);
    // Geometry is shared.
    EXPECT_EQ(written.primitive(i)["attributes"]["POSITION"], 0);
    EXPECT_EQ(written.primitive(i)["indices"], 1);
    EXPECT_EQ(written.floats(written.primitive(i)["attributes"]["TEXCOORD_1"])[0], i == 1 ? 0.5f : 0.0f);
    const ordered_json& material = written.document["materials"][written.primitive(i)["material"].get<std::size_t>()];
    EXPECT_EQ(material["name"], "grey");
    EXPECT_EQ(material["extensions"]["MOZ_lightmap"]["intensity"], i < 2 ? 10 : 11);
  }
}

TEST(WriteGltf, LetsInstancesWithEqualLightShareTheirMesh) {
  GltfBuilder file = mapped_square();
  file.add_root({{"mesh", 0}, {"translation", {5, 0, 0}}});
  const Written written = write_baked(file.glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.document["meshes"].size(), 1u);
  EXPECT_EQ(written.document["materials"].size(), 1u);
}

TEST(WriteGltf, LeavesMaterialsAndMeshesOfWhatWasNotBakedAlone) {
  GltfBuilder file = mapped_square();
  file.add("nodes", {{"name", "in no scene"}, {"mesh", 0}});
  const int points = file.add_mesh({{"attributes", {{"POSITION", 0}}}, {"mode", 0}, {"material", 0}});
  file.add_root({{"mesh", points}});
  const Written written = write_baked(file.glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.primitive(0).dump(), ordered_json(file.document["meshes"][0]["primitives"][0]).dump());
  EXPECT_EQ(written.primitive(1).dump(), ordered_json(file.document["meshes"][1]["primitives"][0]).dump());
  EXPECT_EQ(written.document["materials"][0].dump(), ordered_json(file.document["materials"][0]).dump());
  EXPECT_EQ(written.document["nodes"][0]["mesh"], 2);
  EXPECT_EQ(written.document["nodes"][1]["mesh"], 0);
  EXPECT_EQ(written.primitive(2)["material"], 1);
}

TEST(WriteGltf, SpellsOutTheDefaultMaterialWhereThereIsNone) {
  GltfBuilder file = mapped_square();
  file.document.erase("materials");
  file.document["meshes"][0]["primitives"][0].erase("material");
  const Written written = write_baked(file.glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.primitive(0)["material"], 0);
  EXPECT_EQ(written.document["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 1);
  EXPECT_TRUE(written.document["materials"][0]["extensions"].contains("MOZ_lightmap"));
}

TEST(WriteGltf, LightsTheMaterialsOfVariantsToo) {
  GltfBuilder file = mapped_square();
  file.add("materials", {{"name", "night"}});
  file.document["extensionsUsed"] = {"KHR_materials_variants"};
  file.document["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "night"}}};
  file.document["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
      {{"material", 1}, {"variants", {0}}}};
  const Written written = write_baked(file.glb(), in_lightmap_0);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.document["materials"].size(), 2u);
  EXPECT_TRUE(written.document["materials"][1]["extensions"].contains("MOZ_lightmap"));
}

TEST(WriteGltf, TakesBuffersAndImagesIn) {
  GltfBuilder file = mapped_square();
  file.document["buffers"][0]["uri"] = "first.bin";
  const std::string second(8, '\x07');
  file.document["buffers"].push_back({{"byteLength", 8}, {"uri", "second%20.bin"}, {"name", "more"}});
  file.add("bufferViews", {{"buffer", 1}, {"byteLength", 8}});
  file.add("images", {{"uri", "wall.png"}});
  file.add("images", {{"uri", "missing.png"}});
  const Written written =
      write_baked(file.document.dump(), in_lightmap_0, {}, "scene.gltf",
                  {{"first.bin", file.bin}, {"second .bin", second}, {"wall.png", "\x89PNG of a wall"}});
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  ASSERT_EQ(written.document["buffers"].size(), 1u);
  EXPECT_FALSE(written.document["buffers"][0].contains("uri"));
  EXPECT_EQ(written.document["buffers"][0]["byteLength"], written.bin.size());
  EXPECT_EQ(written.document["buffers"][0]["extras"]["merged"][0]["name"], "more");
  const ordered_json& view = written.document["bufferViews"][3];
  EXPECT_EQ(written.bin.substr(view["byteOffset"], view["byteLength"]), second);
  const ordered_json& image = written.document["images"][0];
  EXPECT_EQ(image["name"], "wall");
  EXPECT_EQ(image["mimeType"], "image/png");
  const ordered_json& png = written.document["bufferViews"][image["bufferView"].get<std::size_t>()];
  EXPECT_EQ(written.bin.substr(png["byteOffset"], png["byteLength"]), "\x89PNG of a wall");
  EXPECT_EQ(written.document["images"][1].dump(), R"({"uri":"missing.png"})");
}

TEST(WriteGltf, WritesIrradianceByVertex) {
  const auto light = [](const Scene& scene, std::vector<BakedMesh>& baked) {
    for (std::size_t i = 0; i < scene.meshes[0].positions.size(); ++i) {
      const float f = static_cast<float>(i);
      baked[0].irradiance.push_back({f, 10 * f, 100 * f});
    }
  };
  const Written written = write_baked(square().glb(), light);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& attributes = written.primitive(0)["attributes"];
  EXPECT_THAT(written.floats(attributes["_IRRADIANCE"]), ElementsAre(0, 0, 0, 1, 10, 100, 2, 20, 200, 3, 30, 300));
  EXPECT_FALSE(attributes.contains("COLOR_0"));
  EXPECT_FALSE(written.document["materials"][0].contains("extensions"));
  EXPECT_FALSE(written.document.contains("extensionsUsed"));
}

TEST(WriteGltf, MultipliesVertexColorsByTheLightAndKeepsThem) {
  GltfBuilder file = square();
  const int colors = file.add_accessor(
      file.add_view(bytes_of<std::uint8_t>({255, 255, 255, 255, 0, 255, 51, 0, 255, 0, 0, 255, 0, 0, 0, 255})), 5121,
      "VEC4", 4);
  file.document["accessors"][colors]["normalized"] = true;
  file.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors;
  const auto light = [](const Scene&, std::vector<BakedMesh>& baked) {
    baked[0].irradiance = {{50, 0, 0}, {100, 100, 100}, {25, 0, 0}, {0, 0, 0}};
  };
  WriteOptions options;
  options.vertex_colors = true;
  const Written written = write_baked(file.glb(), light, options);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& attributes = written.primitive(0)["attributes"];
  EXPECT_EQ(attributes["_COLOR_0_SOURCE"], colors);
  // The scene's brightest is 100 lx; the second vertex is green with a fifth of blue, and see-through.
  EXPECT_THAT(written.floats(attributes["COLOR_0"]),
              ElementsAre(0.5, 0, 0, 1, 0, 1, 0.2f, 0, 0.25, 0, 0, 1, 0, 0, 0, 1));
}

TEST(WriteGltf, WritesEqualBytesForEqualBakes) {
  const std::string bytes = mapped_square().glb();
  const auto bake = [](const Scene& scene, std::vector<BakedMesh>& baked) { baked[0] = taken_apart(scene.meshes[0]); };
  const Written one = write_baked(bytes, bake), other = write_baked(bytes, bake);
  EXPECT_EQ(one.document.dump(), other.document.dump());
  EXPECT_EQ(one.bin, other.bin);
}

TEST(WriteGltf, RefusesABakeOfAnotherScene) {
  const TemporaryFolder folder;
  const auto path = folder.write("scene.glb", square().glb());
  const GltfScene scene = read_gltf(path, decode_text_image, {}).value();
  const auto target = folder.path() / "out.glb";
  const auto message = [&](const BakedMesh& mesh) {
    const Result<void> result = write_gltf(target, path, scene, {mesh}, {}, {});
    EXPECT_FALSE(result.ok());
    if (result.ok()) return std::string();
    EXPECT_EQ(result.error().code, ErrorCode::kInternal);
    return result.error().message;
  };
  EXPECT_FALSE(write_gltf(target, path, scene, {}, {}, {}).ok());
  BakedMesh mesh;
  mesh.lightmap = 0;
  EXPECT_THAT(message(mesh), HasSubstr("lightmap 0 of 0"));
  mesh = {};
  mesh.irradiance.resize(3);
  EXPECT_THAT(message(mesh), HasSubstr("3 values"));
  mesh = {};
  mesh.source_vertices = {0, 1, 2, 3, 9};
  EXPECT_THAT(message(mesh), HasSubstr("vertex 4 copies vertex 9"));
  mesh = taken_apart(scene.scene.meshes[0]);
  mesh.lightmap = -1;
  mesh.triangles.pop_back();
  EXPECT_THAT(message(mesh), HasSubstr("1 baked triangles for 2"));
  // The file was changed while it was baked.
  GltfBuilder other = square();
  other.document["nodes"][0].erase("mesh");
  folder.write("scene.glb", other.glb());
  EXPECT_THAT(message({}), HasSubstr("'wall/square#0' is not in the file any more"));
}

}  // namespace
}  // namespace radbake::gltf
