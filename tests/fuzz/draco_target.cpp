// A Draco blob of a stranger, held against a record that he wrote as well: as truthful as it takes to get far.
// Input: one byte of flags, then the blob.

#include <algorithm>
#include <string>

#include "common/base/check.h"
#include "common/codec/draco_peek.h"
#include "common/codec/mesh_codec.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

/// What the record may declare: above it decode_scene() refuses, here as there by a limit.
constexpr std::uint64_t kMaxTriangles = 20'000;

enum Flags : unsigned { kNormals = 1, kTexcoord0 = 2, kTexcoord1 = 4, kColors = 8, kFewVertices = 16, kLies = 32 };

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace radbake;
  fuzz::ByteReader input(bytes, size);
  const unsigned flags = input.byte();
  const std::string blob = input.rest();

  v1::MeshRecord record;
  record.set_name("wall");
  record.set_has_normals(flags & kNormals);
  record.set_has_texcoord0(flags & kTexcoord0);
  record.set_has_texcoord1(flags & kTexcoord1);
  record.set_has_colors(flags & kColors);
  record.set_num_triangles(2);
  const auto claims = peek_draco(blob);
  if (claims.ok() && !(flags & kLies)) {
    record.set_num_triangles(static_cast<std::uint32_t>(std::min(claims->num_faces, kMaxTriangles)));
  }
  record.set_num_vertices(flags & kFewVertices ? 3 : 3 * record.num_triangles());

  const auto mesh = decode_mesh(blob, record, {1, 2, 3});
  if (!mesh.ok()) {
    RADBAKE_CHECK(mesh.error().message.starts_with("mesh 'wall' "));
    // Whoever declares few triangles gets little memory.
    RADBAKE_CHECK(mesh.error().code != ErrorCode::kResourceExhausted);
    return 0;
  }
  RADBAKE_CHECK_EQ(mesh->triangles.size(), record.num_triangles());
  RADBAKE_CHECK_EQ(mesh->positions.size(), record.num_vertices());
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t vertex : triangle) RADBAKE_CHECK_LT(vertex, record.num_vertices());
  }
  for (const Vec3& position : mesh->positions) RADBAKE_CHECK(is_finite(position));
  return 0;
}
