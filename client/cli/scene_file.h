#pragma once

#include <filesystem>
#include <stop_token>
#include <vector>

#include "client/api/client.h"
#include "client/gltf/read_gltf.h"
#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/codec/scene_codec.h"
#include "radbake/v1/bake.pb.h"

namespace radbake::cli {

/// The scene of a bake, as far as scene.glb needs it.
struct BakedScene {
  std::filesystem::path path;
  Digest digest;                  ///< of the file's bytes when it was read
  gltf::GltfScene scene;          ///< textures are not kept
  std::vector<int> scene_meshes;  ///< EncodedScene::scene_meshes
};

/// Reads a scene, with the image library that is loaded when a texture asks for it.
/// Errors: read_gltf()'s, or the library's.
Result<gltf::GltfScene> read_scene(const std::filesystem::path& path, double max_reflectance);

/// Reads a sky of every direction, with the image library that is loaded for it.
/// Errors: image::read_environment()'s, or the library's.
Result<TexturePlane> read_sky_image(const std::filesystem::path& file, double scale);

/// Reads a scene and holds it for after its bake.
Result<BakedScene> keep_for_writing(const std::filesystem::path& path, gltf::GltfScene scene,
                                    const EncodedScene& encoded);

/// Reads the scene of a bake that is finished. Lights and materials may be others; the meshes must encode to the bytes
/// that were baked.
/// Errors: kInvalidArgument, naming the first mesh that differs; those of the download.
Result<BakedScene> read_scene_of(api::Client& client, const v1::Bake& bake, const std::filesystem::path& path,
                                 std::stop_token stop);

}  // namespace radbake::cli
