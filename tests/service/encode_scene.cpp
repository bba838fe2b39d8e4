// Writes a scene as it goes over the wire, for clients without Draco: each blob in a file named by its SHA-256.
//
//   encode_scene SCENE.glb FOLDER [ATLAS_SIZE]     prints the manifest's SHA-256

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "client/gltf/read_gltf.h"
#include "client/image/image_codec.h"
#include "common/codec/scene_codec.h"

namespace {

using namespace radbake;

Result<Digest> encode_to_folder(const std::filesystem::path& file, const std::filesystem::path& folder,
                                int atlas_size) {
  RADBAKE_ASSIGN_OR_RETURN(const image::ImageCodec* images, image::load_image_codec());
  const auto decode_image = [&](std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
    return images->decode_image(bytes, name, is_srgb, image::kDefaultMaxSide);
  };
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, gltf::read_gltf(file, decode_image, {}));
  EncodeOptions options;
  options.atlas_size = atlas_size;
  RADBAKE_ASSIGN_OR_RETURN(EncodedScene encoded, encode_scene(read.scene, options));
  std::filesystem::create_directories(folder);
  for (const EncodedBlob& blob : encoded.blobs) {
    std::ofstream out(folder / blob.digest.sha256, std::ios::binary);
    out << blob.bytes;
    out.close();
    if (!out) return internal_error("cannot write " + (folder / blob.digest.sha256).string());
  }
  return encoded.manifest;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: encode_scene SCENE.glb FOLDER [ATLAS_SIZE]\n";
    return 2;
  }
  const Result<Digest> manifest = encode_to_folder(argv[1], argv[2], argc == 4 ? std::atoi(argv[3]) : 0);
  if (!manifest.ok()) {
    std::cerr << "encode_scene: " << manifest.error().message << "\n";
    return 1;
  }
  std::cout << manifest->sha256 << "\n";
}
