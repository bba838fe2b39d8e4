#include "client/cli/scene_file.h"

#include <optional>

#include "client/gltf/container.h"
#include "client/gltf/limits.h"
#include "client/image/image_codec.h"
#include "radbake/v1/scene.pb.h"

namespace radbake::cli {
namespace {

Digest from_message(const v1::Digest& digest) { return {digest.sha256(), digest.size_bytes()}; }

Result<void> check_same_meshes(const v1::SceneManifest& baked, const v1::SceneManifest& read, const std::string& file,
                               const std::string& bake) {
  const auto refused = [&](const std::string& why) {
    return invalid_argument(file + " is not the scene of " + bake + ": " + why);
  };
  if (baked.meshes_size() != read.meshes_size()) {
    return refused("it has " + std::to_string(read.meshes_size()) + " meshes, baked were " +
                   std::to_string(baked.meshes_size()));
  }
  for (int i = 0; i < baked.meshes_size(); ++i) {
    const v1::MeshRecord &was = baked.meshes(i), &is = read.meshes(i);
    if (was.name() != is.name()) return refused("mesh '" + is.name() + "' was '" + was.name() + "'");
    if (from_message(was.blob()) != from_message(is.blob()) || was.object() != is.object()) {
      return refused("mesh '" + is.name() + "' has changed");
    }
  }
  return {};
}

}  // namespace

Result<gltf::GltfScene> read_scene(const std::filesystem::path& path, double max_reflectance) {
  gltf::ReadOptions options;
  options.max_reflectance = max_reflectance;
  // That the image library cannot be loaded is no fault of the scene, as the reader would say.
  std::optional<Error> not_loaded;
  const auto decode_image = [&](std::span<const std::byte> bytes, const std::string& name,
                                bool is_srgb) -> Result<TexturePlane> {
    const Result<const image::ImageCodec*> images = image::load_image_codec();
    if (images.ok()) return (*images)->decode_image(bytes, name, is_srgb, image::kDefaultMaxSide);
    return not_loaded.emplace(images.error());
  };
  Result<gltf::GltfScene> scene = gltf::read_gltf(path, decode_image, options);
  if (not_loaded) return *not_loaded;
  return scene;
}

Result<TexturePlane> read_sky_image(const std::filesystem::path& file, double scale) {
  RADBAKE_ASSIGN_OR_RETURN(const image::ImageCodec* images, image::load_image_codec());
  return images->read_environment(file, scale, image::kMaxEnvironmentWidth);
}

Result<BakedScene> keep_for_writing(const std::filesystem::path& path, gltf::GltfScene scene,
                                    const EncodedScene& encoded) {
  const Result<std::string> bytes = gltf::read_file(path, gltf::kMaxFileBytes);
  if (!bytes.ok()) return invalid_argument(path.filename().string() + ": " + bytes.error().message);
  scene.scene.textures.clear();
  scene.scene.textures.shrink_to_fit();
  return BakedScene{path, digest_of(*bytes), std::move(scene), encoded.scene_meshes};
}

Result<BakedScene> read_scene_of(api::Client& client, const v1::Bake& bake, const std::filesystem::path& path,
                                 std::stop_token stop) {
  if (!bake.has_manifest()) {
    return internal_error("the server does not say what was baked: without that, no scene.glb can be written");
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::string bytes, client.download(from_message(bake.manifest()), stop));
  v1::SceneManifest baked, read;
  if (!baked.ParseFromString(bytes)) return internal_error("the server sent a manifest that cannot be read");

  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene scene, read_scene(path, gltf::ReadOptions().max_reflectance));
  EncodeOptions encoding;
  encoding.atlas_size = static_cast<int>(bake.settings().atlas_size());
  if (bake.settings().texels_per_meter() > 0) encoding.texels_per_meter = bake.settings().texels_per_meter();
  RADBAKE_ASSIGN_OR_RETURN(const EncodedScene encoded, encode_scene(scene.scene, encoding));
  read.ParseFromString(encoded.blobs.back().bytes);
  RADBAKE_RETURN_IF_ERROR(check_same_meshes(baked, read, path.filename().string(), bake.name()));
  return keep_for_writing(path, std::move(scene), encoded);
}

}  // namespace radbake::cli
