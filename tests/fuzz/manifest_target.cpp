// The manifest of a stranger: what the server checks before it queues, then what the worker does with it. Blobs are
// made up: of the size that is asked for, the sheet's mesh and textures where the sizes are theirs, else zeros.

#include <grpcpp/grpcpp.h>

#include <map>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/codec/scene_codec.h"
#include "server/service/scene_check.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/unit/codec/codec_scenes.h"

namespace {

using namespace radbake;  // NOLINT(google-build-using-namespace)

constexpr std::uint64_t kMaxMadeUpBytes = 64 << 10;

/// Blobs of good scenes by their size.
const std::map<std::uint64_t, std::string>& good_blobs() {
  static const std::map<std::uint64_t, std::string> blobs = [] {
    std::map<std::uint64_t, std::string> found;
    for (const Scene& scene : {sheet_scene(2), sheet_scene(8), luminaire_scene(), environment_scene()}) {
      const EncodedScene encoded = *encode_scene(scene, {});
      for (const EncodedBlob& blob : encoded.blobs) found.emplace(blob.bytes.size(), blob.bytes);
    }
    return found;
  }();
  return blobs;
}

Result<std::string> make_up_blob(const Digest& digest) {
  if (const auto good = good_blobs().find(digest.size_bytes); good != good_blobs().end()) return good->second;
  if (digest.size_bytes <= kMaxMadeUpBytes) return std::string(digest.size_bytes, '\0');
  return Error{ErrorCode::kNotFound, "no blob of " + std::to_string(digest.size_bytes) + " bytes"};
}

void check(const Scene& scene) {
  const auto num_materials = static_cast<int>(scene.materials.size());
  for (const Mesh& mesh : scene.meshes) {
    RADBAKE_CHECK_LT(mesh.material, num_materials);
    RADBAKE_CHECK(!mesh.triangles.empty());
  }
  const auto num_textures = static_cast<int>(scene.textures.size());
  for (const Material& material : scene.materials) {
    RADBAKE_CHECK(max_component(material.reflectance) < 1);
    for (const auto& reference : material.textures()) {
      if (reference) RADBAKE_CHECK_LT(reference->texture, num_textures);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string manifest(reinterpret_cast<const char*>(bytes), size);
  const Limits limits;
  std::vector<Digest> inputs;
  const grpc::Status admitted = service::check_manifest(manifest, digest_of(manifest), limits, inputs);
  RADBAKE_CHECK_LE(inputs.size(), 2 + limits.max_meshes + limits.max_textures);

  const auto scene = decode_scene(manifest, make_up_blob, default_limits());
  if (scene.ok()) {
    // The server refuses no scene that its worker would bake.
    RADBAKE_CHECK(admitted.ok());
    check(*scene);
  } else {
    RADBAKE_CHECK(scene.error().code != ErrorCode::kInternal);
  }
  return 0;
}
