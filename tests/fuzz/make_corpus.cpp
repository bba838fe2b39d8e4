// Writes the inputs that fuzzers start from: good ones, and attacks made by hand, each named by what it is.
//
//   make_fuzz_corpus FOLDER      one folder a target below FOLDER

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <random>

#include "common/base/check.h"
#include "common/codec/scene_codec.h"
#include "server/radiosity/bake/row_checkpoint.h"
#include "tests/fuzz/attacks.h"
#include "tests/unit/codec/codec_scenes.h"

namespace radbake {
namespace {

using namespace attacks;  // NOLINT(google-build-using-namespace)

/// Writes inputs into one folder.
class Folder {
 public:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) { std::filesystem::create_directories(path_); }

  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file << bytes;
    RADBAKE_CHECK(file.good());
  }

 private:
  std::filesystem::path path_;
};

/// The head of a Draco mesh by edgebreaker, up to its counts.
std::string edgebreaker_head(std::uint64_t num_points, std::uint64_t num_faces, int num_connectivities,
                             std::uint64_t num_symbols, std::uint64_t num_splits) {
  std::string bytes = "DRACO" + bytes_of({2, 2, 1, 1, 0, 0, 0});
  append_varint(bytes, num_points);
  append_varint(bytes, num_faces);
  bytes.push_back(static_cast<char>(num_connectivities));
  append_varint(bytes, num_symbols);
  append_varint(bytes, num_splits);
  return bytes;
}

// Flags of draco_target.cpp: normals, both texture coordinates.
constexpr char kSheetFlags = 7, kNoFlags = 0, kLies = 32;

std::string encoded(draco::Mesh& mesh, draco::MeshEncoderMethod method) {
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  draco::EncoderBuffer buffer;
  RADBAKE_CHECK(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

/// A sheet as Draco's own mesh.
std::unique_ptr<draco::Mesh> draco_sheet() {
  const EncodedScene scene = *encode_scene(sheet_scene(3), {});
  draco::DecoderBuffer buffer;
  buffer.Init(scene.blobs[0].bytes.data(), scene.blobs[0].bytes.size());
  return std::move(draco::Decoder().DecodeMeshFromBuffer(&buffer)).value();
}

void add_attribute(draco::Mesh& mesh, int num_components, draco::DataType type) {
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, static_cast<std::uint8_t>(num_components), type, false,
                 std::int64_t{draco::DataTypeLength(type)} * num_components, 0);
  const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
  const std::vector<char> zeros(static_cast<std::size_t>(attribute.byte_stride()));
  for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), zeros.data());
  }
}

void write_draco(const Folder& folder) {
  // Good ones: quantised and float32, manifold and soup, with every attribute.
  Scene soup = sheet_scene(3), colored = sheet_scene(2), bare = sheet_scene(1);
  std::mt19937 random(7);
  for (auto& triangle : soup.meshes[0].triangles) {
    for (std::uint32_t& vertex : triangle) vertex = static_cast<std::uint32_t>(random() % 16);
  }
  colored.meshes[0].colors.assign(colored.meshes[0].positions.size(), {0.5, 0.25, 1});
  bare.meshes[0].normals.clear();
  bare.meshes[0].texcoord0.clear();
  bare.meshes[0].texcoord1.clear();
  bare.materials = {Material()};
  const auto blob = [](const Scene& scene, double texels_per_meter = 32) {
    return encode_scene(scene, {.texels_per_meter = texels_per_meter})->blobs[0].bytes;
  };
  const std::string sheet = blob(sheet_scene(3));
  folder.write("sheet", kSheetFlags + sheet);
  folder.write("sheet_of_float32", kSheetFlags + blob(sheet_scene(2), 1e9));
  folder.write("soup", kSheetFlags + blob(soup));
  folder.write("soup_of_float32", kSheetFlags + blob(soup, 1e9));
  folder.write("colors", static_cast<char>(kSheetFlags | 8) + blob(colored));
  folder.write("positions_alone", kNoFlags + blob(bare));
  folder.write("sequential", kSheetFlags + encoded(*draco_sheet(), draco::MESH_SEQUENTIAL_ENCODING));

  // Attacks on counts.
  constexpr auto kMax = std::numeric_limits<std::uint32_t>::max();
  folder.write("bomb_of_42_bytes", kLies + draco_bomb(50'000'000));
  folder.write("bomb_that_its_record_vouches_for", kNoFlags + draco_bomb(20'000));
  folder.write("points_overflow", kNoFlags + edgebreaker_head(kMax, 100, 0, 100, 0));
  folder.write("faces_overflow", kNoFlags + edgebreaker_head(3, kMax, 0, kMax, 0));
  folder.write("symbols_overflow", kNoFlags + edgebreaker_head(300, 100, 0, kMax, 0));
  folder.write("splits_overflow", kNoFlags + edgebreaker_head(300, 100, 0, 100, kMax));
  folder.write("connectivities_255", kNoFlags + edgebreaker_head(300, 100, 255, 100, 0));
  folder.write("varint_without_end",
               kNoFlags + ("DRACO" + bytes_of({2, 2, 1, 1, 0, 0, 0})) + std::string(20, static_cast<char>(0xff)));
  folder.write("no_faces", kNoFlags + edgebreaker_head(0, 0, 0, 0, 0));
  std::string sequential = "DRACO" + bytes_of({2, 2, 1, 0, 0, 0});
  append_varint(sequential, kMax);
  append_varint(sequential, kMax);
  folder.write("sequential_overflow", kNoFlags + sequential);
  folder.write("cut_in_the_middle", kSheetFlags + sheet.substr(0, sheet.size() / 2));

  // Attacks on attributes.
  for (const auto& [method, name] : {std::pair{draco::MESH_EDGEBREAKER_ENCODING, "edgebreaker"},
                                     std::pair{draco::MESH_SEQUENTIAL_ENCODING, "sequential"}}) {
    auto wide = draco_sheet();
    add_attribute(*wide, 60, draco::DT_FLOAT32);
    folder.write(std::string("sixty_components_") + name, kSheetFlags + encoded(*wide, method));
    auto many = draco_sheet();
    for (int i = 0; i < 100; ++i) add_attribute(*many, 1, draco::DT_UINT8);
    folder.write(std::string("hundred_attributes_") + name, kSheetFlags + encoded(*many, method));
  }
  auto doubles = draco_sheet();
  add_attribute(*doubles, 3, draco::DT_FLOAT64);
  folder.write("attribute_of_doubles", kSheetFlags + encoded(*doubles, draco::MESH_EDGEBREAKER_ENCODING));

  // What is no mesh.
  auto described = draco_sheet();
  auto metadata = std::make_unique<draco::GeometryMetadata>();
  metadata->AddEntryString("name", std::string(200, 'n'));
  described->AddMetadata(std::move(metadata));
  folder.write("metadata", kSheetFlags + encoded(*described, draco::MESH_EDGEBREAKER_ENCODING));
  for (const auto& [method, name] : {std::pair{draco::POINT_CLOUD_SEQUENTIAL_ENCODING, "point_cloud"},
                                     std::pair{draco::POINT_CLOUD_KD_TREE_ENCODING, "point_cloud_of_a_tree"}}) {
    const auto mesh = draco_sheet();
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 8);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, 8);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::TEX_COORD, 8);
    draco::EncoderBuffer buffer;
    RADBAKE_CHECK(encoder.EncodePointCloudToBuffer(*mesh, &buffer).ok());
    folder.write(name, kSheetFlags + std::string(buffer.data(), buffer.size()));
  }
}

void write_manifests(const Folder& folder) {
  const auto manifest = [](const Scene& scene) { return encode_scene(scene, {})->blobs.back().bytes; };
  const std::string sheet = manifest(sheet_scene(2));
  folder.write("sheet", sheet);
  folder.write("luminaires", manifest(luminaire_scene()));
  folder.write("environment", manifest(environment_scene()));

  const auto changed = [&](const std::string& name, const std::function<void(v1::SceneManifest&)>& change) {
    v1::SceneManifest message;
    RADBAKE_CHECK(message.ParseFromString(sheet));
    change(message);
    folder.write(name, message.SerializeAsString());
  };
  constexpr auto kMax = std::numeric_limits<std::uint32_t>::max();
  using M = v1::SceneManifest;
  changed("billion_vertices", [](M& m) { m.mutable_meshes(0)->set_num_vertices(1'000'000'000); });
  changed("triangles_that_overflow", [](M& m) {
    for (int i = 0; i < 3; ++i) *m.add_meshes() = m.meshes(0);
    for (auto& mesh : *m.mutable_meshes()) mesh.set_num_triangles(kMax);
  });
  changed("pixels_that_overflow", [](M& m) {
    m.mutable_textures(0)->set_width(kMax);
    m.mutable_textures(0)->set_height(kMax);
  });
  changed("pixels_of_half_the_range", [](M& m) {
    m.mutable_textures(0)->set_width(1U << 31);
    m.mutable_textures(0)->set_height(1U << 31);
  });
  changed("blob_size_that_overflows",
          [](M& m) { m.mutable_meshes(0)->mutable_blob()->set_size_bytes(std::numeric_limits<std::uint64_t>::max()); });
  changed("digest_is_a_path", [](M& m) { m.mutable_meshes(0)->mutable_blob()->set_sha256("../../../etc/passwd"); });
  changed("digest_is_long", [](M& m) { m.mutable_meshes(0)->mutable_blob()->set_sha256(std::string(5000, 'a')); });
  changed("name_is_long", [](M& m) {
    m.mutable_meshes(0)->set_name(std::string(5000, 'n'));
    m.mutable_meshes(0)->set_material(7);
  });
  changed("material_out_of_range", [](M& m) { m.mutable_meshes(0)->set_material(kMax); });
  changed("texture_out_of_range", [](M& m) { m.mutable_materials(0)->mutable_emissive_texture()->set_texture(kMax); });
  changed("values_that_are_none", [](M& m) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    m.mutable_origin()->set_x(nan);
    m.mutable_sky()->set_r(nan);
    m.mutable_lights(0)->mutable_point()->mutable_intensity()->set_b(nan);
  });
  changed("profile_of_thousands", [](M& m) {
    v1::LightProfile& profile = *m.add_light_profiles();
    for (int i = 0; i < 2000; ++i) profile.add_vertical_degrees(0.09 * i);
    profile.add_horizontal_degrees(0);
    for (int i = 0; i < 2000; ++i) profile.add_candela(1);
  });

  // Attacks on the format, behind a good manifest and alone.
  const auto appended = [&](const std::string& name, const std::string& bytes) { folder.write(name, sheet + bytes); };
  constexpr int kMeshes = 2, kMaterials = 3, kLights = 5, kProfiles = 9;
  appended("groups_in_groups_50", nested_groups(50));
  appended("groups_in_groups_10000", nested_groups(10'000));
  appended("group_without_end", nested_groups(1).substr(0, 2));
  appended("meshes_8193", empty_fields(kMeshes, 8193));
  appended("materials_10000", empty_fields(kMaterials, 10'000));
  appended("lights_1025", empty_fields(kLights, 1025));
  appended("profiles_1025", empty_fields(kProfiles, 1025));
  appended("mesh_of_2_gigabytes", claimed_field(kMeshes, std::uint64_t{1} << 31));
  appended("mesh_of_negative_size", claimed_field(kMeshes, std::numeric_limits<std::uint64_t>::max()));
  std::string packed = claimed_field(1, std::uint64_t{1} << 30);
  appended("packed_doubles_of_a_gigabyte", claimed_field(kProfiles, packed.size()) + packed);
  appended("name_that_is_no_text", claimed_field(kMeshes, 4) + bytes_of({0x0a, 2, 0xff, 0xfe}));
  appended("tag_of_field_0", bytes_of({0, 0}));
  folder.write("nothing", "");
  folder.write("cut_in_the_middle", sheet.substr(0, sheet.size() / 2));
}

// The operations of chunk_stream_target.cpp.
enum Operation { kAppend, kFinish, kQuery, kRead, kAppendWhole, kSendPart, kOutcome, kReopen };
// Its blobs: of 0, 1, 100 and 1000 bytes, then the liars.
enum Blob { kEmpty, kByte, kHundred, kThousand, kTooLarge, kShort, kOther, kPath, kHiddenPath, kOverflow };

void write_chunk_streams(const Folder& folder) {
  // append: blob, offset's kind, offset (2), size (2), whether the bytes are right.
  const std::string first_half = bytes_of({kAppend, kHundred, 0, 0, 0, 50, 0, 1});
  const std::string second_half = bytes_of({kAppend, kHundred, 0, 50, 0, 50, 0, 1});
  folder.write("two_parts", first_half + bytes_of({kQuery, kHundred}) + second_half +
                                bytes_of({kFinish, kHundred, kRead, kHundred}));
  folder.write("parts_that_overlap", first_half + first_half + bytes_of({kAppend, kHundred, 0, 20, 0, 80, 0, 1}) +
                                         bytes_of({kFinish, kHundred, kQuery, kHundred}));
  folder.write("gap", first_half + bytes_of({kAppend, kHundred, 0, 60, 0, 40, 0, 1, kFinish, kHundred}));
  folder.write("wrong_bytes", bytes_of({kAppend, kHundred, 0, 0, 0, 100, 0, 0, kFinish, kHundred, kRead, kHundred}));
  folder.write("beyond_the_end", bytes_of({kAppend, kHundred, 0, 0, 0, 101, 0, 1, kFinish, kHundred}));
  folder.write("offset_that_overflows", bytes_of({kAppend, kHundred, 255, 5, 100, 0, 1, kQuery, kHundred}));
  folder.write("finish_too_early", first_half + bytes_of({kFinish, kHundred, kQuery, kHundred}) + second_half);
  folder.write("finish_without_a_part", bytes_of({kFinish, kEmpty, kFinish, kByte, kRead, kEmpty}));
  folder.write("reopened_half_way", first_half + bytes_of({kReopen}) + second_half + bytes_of({kFinish, kHundred}));
  for (const auto& [blob, name] :
       {std::pair{kTooLarge, "too_large"}, std::pair{kShort, "short"}, std::pair{kOther, "digest_of_other_bytes"},
        std::pair{kPath, "digest_is_a_path"}, std::pair{kHiddenPath, "digest_hides_a_path"},
        std::pair{kOverflow, "size_that_overflows"}}) {
    folder.write(name, bytes_of({kAppendWhole, blob, kQuery, blob, kRead, blob, kFinish, blob}));
  }
  // send part: blob, how (1 offset, 2 size, 4 last, 8 another name), its operands.
  folder.write("result_of_one_part", bytes_of({kSendPart, kHundred, 4, kRead, kHundred, kOutcome, kHundred}));
  folder.write("result_of_two_parts", bytes_of({kSendPart, kThousand, 2, 100, 0, kSendPart, kThousand, 6, 100, 0}));
  folder.write("result_with_a_gap", bytes_of({kSendPart, kThousand, 0, kSendPart, kThousand, 5, 7, 7}));
  folder.write("result_that_changes_its_name", bytes_of({kSendPart, kByte, 0, kSendPart, kByte, 12}));
  folder.write("result_of_other_bytes", bytes_of({kSendPart, kOther, 4, kOutcome, kOther, kSendPart, kByte, 4}));
  std::string large;
  for (int i = 0; i < 60; ++i) large += bytes_of({kSendPart, kThousand, 0});
  folder.write("result_without_end", large);
}

void write_row_blocks(const Folder& folder) {
  // As row_block_target.cpp has it.
  constexpr std::uint64_t kFingerprint = 7;
  std::vector<radiosity::TakenRow> rows(100);
  std::vector<std::uint32_t> patches;
  for (std::uint32_t i = 0; i < rows.size(); i += 9) {
    radiosity::TakenRow& taken = rows[i];
    for (std::uint32_t k = 0; k < i; k += 7) taken.row.entries.push_back({k, 1.5F});
    taken.row.counted = 64;
    taken.length = static_cast<std::uint32_t>(taken.row.entries.size());
    taken.sample.reflectance = {0.5, 0.25, 0.125};
    patches.push_back(i);
  }
  const std::string good = radiosity::write_row_block(kFingerprint, patches, rows);
  folder.write("rows", good);
  folder.write("no_rows", radiosity::write_row_block(kFingerprint, {}, rows));
  folder.write("of_another_system", radiosity::write_row_block(kFingerprint + 1, patches, rows));
  folder.write("broken_off", good.substr(0, good.size() / 2));
  std::string claims = good;
  for (std::size_t at = 16; at < 24; ++at) claims[at] = '\x7f';
  folder.write("rows_of_half_the_range", claims);
  rows[9].row.entries = {{99, 1}, {98, 1}};
  folder.write("entries_out_of_order", radiosity::write_row_block(kFingerprint, {9}, rows));
  rows[9].row.entries = {{100, 1}};
  folder.write("entry_of_no_patch", radiosity::write_row_block(kFingerprint, {9}, rows));
  rows[9].row.entries = {};
  rows[9].sample.reflectance = {1, 1, 1};
  folder.write("reflects_all", radiosity::write_row_block(kFingerprint, {9}, rows));
}

void write_gltf_files(const Folder& folder) {
  std::string nested;
  for (int i = 0; i < 10'000; ++i) nested += "[";
  folder.write("nested_lists", R"({"asset":{"version":"2.0"},"extras":)" + nested);
  folder.write("accessor_of_a_billion",
               R"({"asset":{"version":"2.0"},"accessors":[{"componentType":5126,"type":"MAT4","count":1000000000}],)"
               R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],)"
               R"("scenes":[{"nodes":[0]}],"scene":0})");
  std::string instances = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)";
  // A tree that doubles at every level would have a thousand million leaves; glTF allows no node two parents.
  for (int i = 0; i < 30; ++i) {
    instances += R"({"children":[)" + std::to_string(i + 1) + "," + std::to_string(i + 1) + "]},";
  }
  folder.write("nodes_that_double", instances + R"({"name":"leaf"}]})");
  const std::string glb = "glTF" + bytes_of({2, 0, 0, 0});
  folder.write("glb_of_4_gigabytes", glb + std::string(4, static_cast<char>(0xff)));
  folder.write("chunk_of_4_gigabytes",
               glb + bytes_of({20, 0, 0, 0}) + std::string(4, static_cast<char>(0xff)) + "JSON");
}

}  // namespace
}  // namespace radbake

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_fuzz_corpus FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  radbake::write_draco(radbake::Folder(folder / "draco"));
  radbake::write_manifests(radbake::Folder(folder / "manifest"));
  radbake::write_chunk_streams(radbake::Folder(folder / "chunk_stream"));
  radbake::write_row_blocks(radbake::Folder(folder / "row_block"));
  radbake::write_gltf_files(radbake::Folder(folder / "gltf"));
}
