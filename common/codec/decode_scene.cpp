#include <algorithm>
#include <exception>
#include <new>

#include "common/base/limits.h"
#include "common/codec/manifest_codec.h"
#include "common/codec/mesh_codec.h"
#include "common/codec/scene_codec.h"
#include "common/codec/texture_codec.h"

namespace radbake {
namespace {

Result<void> check_limit(std::uint64_t count, const char* what, std::uint64_t limit, const char* limit_name) {
  if (count <= limit) return {};
  return Error{ErrorCode::kResourceExhausted, "the scene has " + std::to_string(count) + " " + what + "; " +
                                                  limit_name + " is " + std::to_string(limit)};
}

/// Checks all counts of a manifest. Allocates nothing.
Result<void> check_counts(const v1::SceneManifest& manifest, const v1::Limits& limits) {
  if (manifest.meshes().empty()) return invalid_argument("the scene has no mesh");
  RADBAKE_RETURN_IF_ERROR(check_limit(manifest.meshes_size(), "meshes", limits.max_meshes(), "max_meshes"));
  // A mesh has one material: more are of no use.
  RADBAKE_RETURN_IF_ERROR(check_limit(manifest.materials_size(), "materials", limits.max_meshes(), "max_meshes"));
  RADBAKE_RETURN_IF_ERROR(check_limit(manifest.textures_size(), "textures", limits.max_textures(), "max_textures"));
  RADBAKE_RETURN_IF_ERROR(check_limit(manifest.lights_size(), "lights", limits.max_lights(), "max_lights"));
  RADBAKE_RETURN_IF_ERROR(
      check_limit(manifest.light_profiles_size(), "light profiles", limits.max_lights(), "max_lights"));
  std::uint64_t num_vertices = 0, num_triangles = 0;
  for (const v1::MeshRecord& mesh : manifest.meshes()) {
    const std::string owner = "mesh '" + mesh.name() + "'";
    if (mesh.material() >= static_cast<std::uint32_t>(manifest.materials_size())) {
      return invalid_argument(owner + " has material " + std::to_string(mesh.material()) + " of " +
                              std::to_string(manifest.materials_size()));
    }
    if (mesh.num_triangles() == 0) return invalid_argument(owner + " has no triangle");
    num_vertices += mesh.num_vertices();
    num_triangles += mesh.num_triangles();
  }
  RADBAKE_RETURN_IF_ERROR(check_limit(num_vertices, "vertices", limits.max_vertices(), "max_vertices"));
  RADBAKE_RETURN_IF_ERROR(check_limit(num_triangles, "triangles", limits.max_triangles(), "max_triangles"));
  for (const v1::Texture& texture : manifest.textures()) {
    RADBAKE_RETURN_IF_ERROR(check_texture(texture, limits.max_texture_pixels()));
  }
  if (manifest.has_environment()) {
    RADBAKE_RETURN_IF_ERROR(check_environment(manifest.environment(), limits.max_texture_pixels()));
  }
  return {};
}

/// Reads the blob of a mesh or texture and checks that it is of the declared size.
Result<std::string> read_declared(const v1::Digest& digest, const std::string& owner, const BlobReader& read_blob,
                                  const v1::Limits& limits) {
  if (auto valid = validate_sha256(digest.sha256()); !valid.ok()) {
    return invalid_argument(owner + ": " + valid.error().message);
  }
  if (digest.size_bytes() > limits.max_blob_bytes()) {
    return Error{ErrorCode::kResourceExhausted, owner + " has a blob of " + std::to_string(digest.size_bytes()) +
                                                    " bytes; max_blob_bytes is " +
                                                    std::to_string(limits.max_blob_bytes())};
  }
  auto blob = read_blob({digest.sha256(), digest.size_bytes()});
  if (!blob.ok()) return Error{blob.error().code, owner + ": " + blob.error().message};
  if (blob->size() != digest.size_bytes()) {
    return Error{ErrorCode::kDataLoss, owner + " has a blob of " + std::to_string(blob->size()) +
                                           " bytes, its digest says " + std::to_string(digest.size_bytes())};
  }
  return blob;
}

/// A texture coordinate that a material uses must be there.
Result<void> check_texcoords(const Mesh& mesh, const Material& material) {
  for (const auto& reference : material.textures()) {
    if (!reference || !(reference->texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1).empty()) continue;
    return invalid_argument("mesh '" + mesh.name + "' has no texcoord " + std::to_string(reference->texcoord) +
                            ", which a texture of its material '" + material.name + "' uses");
  }
  return {};
}

/// The factor on the texels per metre; absent: 1.
Result<double> read_texel_density(const v1::MeshRecord& record) {
  const double density = record.texel_density();
  if (density == 0) return 1.0;
  if (density >= kMinTexelDensity && density <= kMaxTexelDensity) return density;
  return invalid_argument("mesh '" + record.name() + "' has a texel density of " + std::to_string(density) +
                          ", outside " + std::to_string(kMinTexelDensity) + " to " + std::to_string(kMaxTexelDensity));
}

Result<Scene> decode(const v1::SceneManifest& manifest, const BlobReader& read_blob, const v1::Limits& limits) {
  RADBAKE_RETURN_IF_ERROR(check_counts(manifest, limits));
  Scene scene;
  RADBAKE_ASSIGN_OR_RETURN(const Vec3 origin, read_origin(manifest));
  RADBAKE_ASSIGN_OR_RETURN(scene.sky, read_sky(manifest));
  std::vector<std::shared_ptr<const LightProfile>> profiles;
  for (const v1::LightProfile& record : manifest.light_profiles()) {
    RADBAKE_ASSIGN_OR_RETURN(std::shared_ptr<const LightProfile> profile, read_light_profile(record, profiles.size()));
    profiles.push_back(std::move(profile));
  }
  for (const v1::Light& record : manifest.lights()) {
    RADBAKE_ASSIGN_OR_RETURN(Light light, read_light(record, profiles));
    scene.lights.push_back(std::move(light));
  }
  for (const v1::Material& record : manifest.materials()) {
    RADBAKE_ASSIGN_OR_RETURN(Material material, read_material(record, manifest.textures_size()));
    scene.materials.push_back(std::move(material));
  }
  for (const v1::Texture& record : manifest.textures()) {
    RADBAKE_ASSIGN_OR_RETURN(const std::string blob,
                             read_declared(record.blob(), "texture '" + record.name() + "'", read_blob, limits));
    RADBAKE_ASSIGN_OR_RETURN(TexturePlane plane, decode_texture(blob, record));
    scene.textures.push_back(std::move(plane));
  }
  if (manifest.has_environment()) {
    if (!(scene.sky == Vec3{})) return invalid_argument("the scene has a constant sky and an environment: one of them");
    const v1::Environment& record = manifest.environment();
    RADBAKE_ASSIGN_OR_RETURN(
        const std::string blob,
        read_declared(record.blob(), "the environment '" + record.name() + "'", read_blob, limits));
    RADBAKE_ASSIGN_OR_RETURN(scene.environment, decode_environment(blob, record));
  }
  scene.num_instances = manifest.num_instances();
  for (const v1::MeshRecord& record : manifest.meshes()) {
    RADBAKE_ASSIGN_OR_RETURN(const std::string blob,
                             read_declared(record.blob(), "mesh '" + record.name() + "'", read_blob, limits));
    RADBAKE_ASSIGN_OR_RETURN(Mesh mesh, decode_mesh(blob, record, origin));
    RADBAKE_RETURN_IF_ERROR(check_texcoords(mesh, scene.materials[mesh.material]));
    mesh.object = static_cast<int>(record.object() & 0x7fffffffu);
    RADBAKE_ASSIGN_OR_RETURN(mesh.texel_density, read_texel_density(record));
    scene.meshes.push_back(std::move(mesh));
  }
  return scene;
}

}  // namespace

Result<Scene> decode_scene(const std::string& manifest, const BlobReader& read_blob, const v1::Limits& limits) {
  if (manifest.size() > limits.max_manifest_bytes()) {
    return Error{ErrorCode::kResourceExhausted, "the scene manifest has " + std::to_string(manifest.size()) +
                                                    " bytes; max_manifest_bytes is " +
                                                    std::to_string(limits.max_manifest_bytes())};
  }
  try {
    v1::SceneManifest parsed;
    if (!parsed.ParseFromString(manifest)) return invalid_argument("the scene manifest is not a valid message");
    return decode(parsed, read_blob, limits);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kResourceExhausted, "the scene needs more memory to decode than there is"};
  } catch (const std::exception& exception) {
    return internal_error(std::string("decoding the scene: ") + exception.what());
  }
}

v1::Limits default_limits() { return limits_message<v1::Limits>(Limits{}); }

}  // namespace radbake
