// A .glb or .gltf file of a stranger, as the command line reads it. Images do not decode here.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "client/gltf/read_gltf.h"
#include "common/base/check.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace radbake;
  // A file that has only a path, and no folder beside it to look into.
  const int file = memfd_create("scene.glb", MFD_CLOEXEC);
  RADBAKE_CHECK(file >= 0 && ::write(file, bytes, size) == static_cast<ssize_t>(size));
  const auto scene = gltf::read_gltf(
      "/proc/self/fd/" + std::to_string(file),
      [](std::span<const std::byte>, const std::string& name, bool) -> Result<TexturePlane> {
        TexturePlane plane{.name = name, .width = 1, .height = 1, .channels = 4, .values = {1, 1, 1, 1}};
        return plane;
      },
      {});
  ::close(file);
  if (!scene.ok()) {
    RADBAKE_CHECK(scene.error().code != ErrorCode::kInternal);
    return 0;
  }
  for (const Mesh& mesh : scene->scene.meshes) {
    RADBAKE_CHECK_LT(static_cast<std::size_t>(mesh.material), scene->scene.materials.size());
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) RADBAKE_CHECK_LT(vertex, mesh.positions.size());
    }
  }
  return 0;
}
