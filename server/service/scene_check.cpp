#include "server/service/scene_check.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "common/base/shortened.h"
#include "common/base/version.h"
#include "radbake/v1/scene.pb.h"
#include "server/service/convert.h"
#include "server/service/status.h"
#include "server/settings/to_options.h"

namespace radbake::service {
namespace {

constexpr double kMaxTexelsPerMeter = 1e6;
constexpr std::uint32_t kMaxThreads = 1024;
constexpr std::size_t kMaxNameBytes = 100;  // in a message

grpc::Status check_settings(const v1::BakeSettings& settings, const v1::RunOptions& run, const Limits& limits) {
  const std::uint32_t size = settings.atlas_size();
  if (size != 0 && (size < limits.min_atlas_size || size > limits.max_atlas_size || !std::has_single_bit(size))) {
    return bad_field("settings.atlas_size", std::to_string(size) + " is not a power of two from min_atlas_size " +
                                                std::to_string(limits.min_atlas_size) + " to max_atlas_size " +
                                                std::to_string(limits.max_atlas_size));
  }
  const double density = settings.texels_per_meter();
  if (!(density >= 0 && density <= kMaxTexelsPerMeter)) {
    return bad_field("settings.texels_per_meter", std::to_string(density) + " is not between 0 and 1000000");
  }
  if (settings.rays() > limits.max_rays) {
    return bad_field("settings.rays",
                     std::to_string(settings.rays()) + " is above max_rays " + std::to_string(limits.max_rays));
  }
  if (settings.max_patches() > limits.max_patches) {
    return bad_field("settings.max_patches", std::to_string(settings.max_patches()) + " is above max_patches " +
                                                 std::to_string(limits.max_patches));
  }
  if (!v1::LightmapUv_IsValid(settings.lightmap_uv())) {
    return bad_field("settings.lightmap_uv", std::to_string(settings.lightmap_uv()) + " is not a LightmapUv");
  }
  if (!v1::Output_IsValid(settings.output())) {
    return bad_field("settings.output", std::to_string(settings.output()) + " is not an Output");
  }
  if (const auto problem = settings::find_effect_problem(settings)) {
    return bad_field(problem->field, problem->description);
  }
  if (const auto problem = settings::find_target_problem(settings)) {
    return bad_field(problem->field, problem->description);
  }
  if (const auto problem = settings::find_size_problem(settings)) {
    return bad_field(problem->field, problem->description);
  }
  if (run.threads() > kMaxThreads) {
    return bad_field("run.threads", std::to_string(run.threads()) + " is above " + std::to_string(kMaxThreads));
  }
  return grpc::Status::OK;
}

struct Count {
  const char* limit;
  std::uint64_t value, bound;
};

grpc::Status hold_against_limits(std::span<const Count> counts) {
  for (const Count& count : counts) {
    if (count.value > count.bound) return above_limit(count.limit, count.value, count.bound);
  }
  return grpc::Status::OK;
}

/// Counts a manifest's records before memory is taken for them: two bytes may become an object of 200.
grpc::Status check_records(const std::string& bytes, const Limits& limits) {
  using Wire = google::protobuf::internal::WireFormatLite;
  using M = v1::SceneManifest;
  google::protobuf::io::CodedInputStream input(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                               static_cast<int>(bytes.size()));
  std::map<int, std::uint64_t> records;
  for (std::uint32_t tag = input.ReadTag(); tag != 0 && Wire::SkipField(&input, tag); tag = input.ReadTag()) {
    const int field = Wire::GetTagFieldNumber(tag);
    if (field <= M::kLightProfilesFieldNumber) ++records[field];
  }
  // A mesh has one material: more are of no use.
  const Count counts[] = {
      {"max_meshes", records[M::kMeshesFieldNumber], limits.max_meshes},
      {"max_meshes", records[M::kMaterialsFieldNumber], limits.max_meshes},
      {"max_textures", records[M::kTexturesFieldNumber], limits.max_textures},
      {"max_lights", records[M::kLightsFieldNumber], limits.max_lights},
      {"max_lights", records[M::kLightProfilesFieldNumber], limits.max_lights},
  };
  return hold_against_limits(counts);
}

grpc::Status check_counts(const v1::SceneManifest& manifest, const Limits& limits) {
  std::uint64_t num_vertices = 0, num_triangles = 0, num_pixels = 0;
  for (const v1::MeshRecord& mesh : manifest.meshes()) {
    num_vertices += mesh.num_vertices();
    num_triangles += mesh.num_triangles();
  }
  for (const v1::Texture& texture : manifest.textures()) {
    num_pixels = std::max(num_pixels, std::uint64_t{texture.width()} * texture.height());
  }
  const v1::Environment& sky = manifest.environment();
  num_pixels = std::max(num_pixels, std::uint64_t{sky.width()} * sky.height());
  const Count counts[] = {
      {"max_vertices", num_vertices, limits.max_vertices},
      {"max_triangles", num_triangles, limits.max_triangles},
      {"max_texture_pixels", num_pixels, limits.max_texture_pixels},
  };
  return hold_against_limits(counts);
}

}  // namespace

grpc::Status check_manifest(const std::string& bytes, const Digest& digest, const Limits& limits,
                            std::vector<Digest>& inputs) {
  if (auto status = check_records(bytes, limits); !status.ok()) return status;
  v1::SceneManifest manifest;
  if (!manifest.ParseFromString(bytes)) {
    return bad_field("manifest", "blob " + digest.sha256 + " is not a SceneManifest");
  }
  if (auto status = check_counts(manifest, limits); !status.ok()) return status;

  // Every blob once, the manifest first.
  std::set<Digest> known = {digest};
  inputs = {digest};
  const auto add = [&](const v1::Digest& message, const std::string& name) {
    Digest blob = from_message(message);
    if (auto valid = validate_sha256(blob.sha256); !valid.ok()) {
      return bad_field("manifest", name + ": " + valid.error().message);
    }
    if (known.insert(blob).second) inputs.push_back(std::move(blob));
    return grpc::Status::OK;
  };
  for (const v1::MeshRecord& mesh : manifest.meshes()) {
    if (auto status = add(mesh.blob(), "mesh '" + shortened(mesh.name(), kMaxNameBytes) + "'"); !status.ok())
      return status;
  }
  for (const v1::Texture& texture : manifest.textures()) {
    if (auto status = add(texture.blob(), "texture '" + shortened(texture.name(), kMaxNameBytes) + "'"); !status.ok())
      return status;
  }
  if (manifest.has_environment()) {
    const v1::Environment& sky = manifest.environment();
    if (auto status = add(sky.blob(), "environment '" + shortened(sky.name(), kMaxNameBytes) + "'"); !status.ok())
      return status;
  }
  return grpc::Status::OK;
}

grpc::Status check_scene(const SceneRequest& request, const Limits& limits, std::uint32_t max_threads,
                         const store::ContentStore& content, store::Work& work) {
  if (auto status = check_settings(request.settings, request.run, limits); !status.ok()) return status;

  // Read the manifest.
  const Digest digest = from_message(request.manifest);
  if (auto valid = validate_sha256(digest.sha256); !valid.ok()) return bad_field("manifest", valid.error().message);
  if (digest.size_bytes > limits.max_manifest_bytes) {
    return above_limit("max_manifest_bytes", digest.size_bytes, limits.max_manifest_bytes);
  }
  if (!content.contains(digest)) return missing_blobs({digest});
  const auto bytes = content.read_blob(digest);
  if (!bytes.ok()) return to_status(bytes.error());
  if (auto status = check_manifest(*bytes, digest, limits, work.inputs); !status.ok()) return status;
  const std::vector<Digest> missing = content.find_missing(work.inputs);
  if (!missing.empty()) return missing_blobs(missing);

  v1::RunOptions run = request.run;
  if (max_threads > 0 && (run.threads() == 0 || run.threads() > max_threads)) run.set_threads(max_threads);
  work.manifest = digest;
  work.settings = request.settings.SerializeAsString();
  work.run = run.SerializeAsString();
  return grpc::Status::OK;
}

std::string make_bake_key(const store::Work& work) {
  return digest_of(work.manifest.sha256 + '\n' + work.settings + '\n' + kEngineVersion).sha256;
}

}  // namespace radbake::service
