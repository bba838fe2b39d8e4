#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/base/check.h"
#include "common/codec/grid.h"
#include "common/codec/manifest_codec.h"
#include "common/codec/mesh_codec.h"
#include "common/codec/scene_codec.h"
#include "common/codec/texture_codec.h"

namespace radbake {
namespace {

// Where the size of the atlas is not known: the largest that a server allows by default.
constexpr int kAssumedAtlasSize = 4096;
// Normals this near to the triangles' own say nothing that the triangles do not.
constexpr double kFlatNormalTolerance = 1e-3;

Result<void> check_mesh(const Scene& scene, const Mesh& mesh) {
  const std::string owner = "mesh '" + mesh.name + "' ";
  const std::size_t num_vertices = mesh.positions.size();
  if (mesh.object < 0) return invalid_argument(owner + "has object " + std::to_string(mesh.object));
  if (mesh.material < 0 || static_cast<std::size_t>(mesh.material) >= scene.materials.size()) {
    return invalid_argument(owner + "has material " + std::to_string(mesh.material) + " of " +
                            std::to_string(scene.materials.size()));
  }
  for (const std::size_t size :
       {mesh.normals.size(), mesh.texcoord0.size(), mesh.texcoord1.size(), mesh.colors.size()}) {
    if (size == 0 || size == num_vertices) continue;
    return invalid_argument(owner + "has an attribute of " + std::to_string(size) + " values for " +
                            std::to_string(num_vertices) + " vertices");
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t vertex : mesh.triangles[i]) {
      if (vertex >= num_vertices) {
        return invalid_argument(owner + "has index " + std::to_string(vertex) + " in triangle " + std::to_string(i) +
                                " of " + std::to_string(num_vertices) + " vertices");
      }
      if (!is_finite(mesh.positions[vertex])) {
        return invalid_argument(owner + "has a position that is not finite at vertex " + std::to_string(vertex));
      }
      if ((!mesh.texcoord0.empty() && !is_finite(mesh.texcoord0[vertex])) ||
          (!mesh.texcoord1.empty() && !is_finite(mesh.texcoord1[vertex]))) {
        return invalid_argument(owner + "has a texture coordinate that is not finite at vertex " +
                                std::to_string(vertex));
      }
    }
  }
  return {};
}

Vec3 face_normal(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3 a = mesh.positions[triangle[0]];
  const Vec3 n = cross(mesh.positions[triangle[1]] - a, mesh.positions[triangle[2]] - a);
  return length(n) > 0 ? normalized(n) : Vec3{};
}

/// The normals to send: none where every one is its triangle's own. Normals that a file leaves at zero become the
/// normal of a triangle that uses them.
std::vector<Vec3> normals_to_send(const Mesh& mesh) {
  std::vector<Vec3> normals = mesh.normals;
  if (normals.empty()) return {};
  bool is_flat = true;
  for (const auto& triangle : mesh.triangles) {
    const Vec3 face = face_normal(mesh, triangle);
    if (face == Vec3{}) continue;
    for (const std::uint32_t vertex : triangle) {
      const double size = length(normals[vertex]);
      normals[vertex] = size > 0 && std::isfinite(size) ? normals[vertex] / size : face;
      is_flat = is_flat && length(normals[vertex] - face) <= kFlatNormalTolerance;
    }
  }
  return is_flat ? std::vector<Vec3>{} : normals;
}

/// The most by which a transform stretches a move: the larger singular value of its linear part.
double largest_stretch(const UvTransform& transform) {
  const double xx = dot(transform.x_axis, transform.x_axis), yy = dot(transform.y_axis, transform.y_axis);
  return std::sqrt((xx + yy) / 2 + std::hypot((xx - yy) / 2, dot(transform.x_axis, transform.y_axis)));
}

/// Texels by which a look-up moves when the mesh's coordinate moves by 1, the largest; 0: nothing looks it up.
double texels_looked_up(const Scene& scene, const Material& material, int texcoord) {
  double size = 0;
  for (const auto& reference : material.textures()) {
    if (!reference || reference->texcoord != texcoord) continue;
    if (reference->texture < 0 || static_cast<std::size_t>(reference->texture) >= scene.textures.size()) continue;
    const TexturePlane& plane = scene.textures[reference->texture];
    // At least 1, also where the transform leaves one point: what is looked up has to be sent.
    size = std::max({size, 1.0, std::max(plane.width, plane.height) * largest_stretch(reference->transform)});
  }
  return size;
}

/// The grid of one mesh's texture coordinates: moved by at most 1/100 texel.
Grid choose_uv_grid(const Mesh& mesh, const std::vector<Vec2>& values, double num_texels) {
  double extent = 0;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      extent = std::max({extent, std::abs(values[vertex].x), std::abs(values[vertex].y)});
    }
  }
  return choose_grid(extent, kUvMoveTexels / num_texels / std::sqrt(2.0));
}

/// How far decoding moved the vertices that triangles use: metres, and texels of what looks the coordinates up.
struct Moves {
  double position = 0, texcoord0 = 0, texcoord1 = 0;
};

Moves measure_moves(const Mesh& before, const Mesh& after, double texels0, double texels1) {
  Moves moves;
  const auto move_of = [](Vec2 a, Vec2 b) { return std::hypot(a.x - b.x, a.y - b.y); };
  for (const auto& triangle : after.triangles) {
    for (const std::uint32_t vertex : triangle) {
      moves.position = std::max(moves.position, length(after.positions[vertex] - before.positions[vertex]));
      if (!after.texcoord0.empty()) {
        const double move = move_of(after.texcoord0[vertex], before.texcoord0[vertex]);
        moves.texcoord0 = std::max(moves.texcoord0, move * texels0);
      }
      if (!after.texcoord1.empty()) {
        const double move = move_of(after.texcoord1[vertex], before.texcoord1[vertex]);
        moves.texcoord1 = std::max(moves.texcoord1, move * texels1);
      }
    }
  }
  return moves;
}

/// Collects blobs, each once.
class Blobs {
 public:
  v1::Digest add(std::string bytes) {
    const Digest digest = digest_of(bytes);
    if (known_.insert(digest).second) blobs_.push_back({digest, std::move(bytes)});
    v1::Digest out;
    out.set_sha256(digest.sha256);
    out.set_size_bytes(digest.size_bytes);
    return out;
  }
  std::vector<EncodedBlob> take() { return std::move(blobs_); }

 private:
  std::set<Digest> known_;
  std::vector<EncodedBlob> blobs_;
};

/// Encodes a mesh, decodes it again, and holds it against the mesh and the bounds.
Result<v1::MeshRecord> encode_and_verify(const Scene& scene, const Mesh& original, const PositionGrid& positions,
                                         int atlas_size, Blobs& blobs, v1::MeshTransfer& transfer) {
  // Choose what is sent, and how.
  Mesh mesh = original;
  mesh.normals = normals_to_send(original);
  const Material& material = scene.materials[mesh.material];
  const double texels0 = texels_looked_up(scene, material, 0);
  const double texels1 =
      std::max<double>(atlas_size > 0 ? atlas_size : kAssumedAtlasSize, texels_looked_up(scene, material, 1));
  MeshLayout layout{positions.origin, positions.grid, !mesh.normals.empty(), {}, {}, !mesh.colors.empty()};
  if (!mesh.texcoord0.empty() && texels0 > 0) layout.texcoord0 = choose_uv_grid(mesh, mesh.texcoord0, texels0);
  if (!mesh.texcoord1.empty()) layout.texcoord1 = choose_uv_grid(mesh, mesh.texcoord1, texels1);

  v1::MeshRecord record;
  record.set_name(mesh.name);
  record.set_material(static_cast<std::uint32_t>(mesh.material));
  const Triangles triangles = canonical_triangles(mesh.triangles);
  record.set_num_vertices(static_cast<std::uint32_t>(mesh.positions.size()));
  record.set_num_triangles(static_cast<std::uint32_t>(triangles.size()));
  record.set_has_normals(layout.has_normals);
  record.set_has_texcoord0(layout.texcoord0.has_value());
  record.set_has_texcoord1(layout.texcoord1.has_value());
  record.set_has_colors(layout.has_colors);
  record.set_object(static_cast<std::uint32_t>(mesh.object));
  record.set_texel_density(mesh.texel_density);

  // Encode, and measure on what comes back.
  RADBAKE_ASSIGN_OR_RETURN(std::string blob, encode_mesh(mesh, layout));
  RADBAKE_ASSIGN_OR_RETURN(const Mesh decoded, decode_mesh(blob, record, positions.origin));
  const Moves moves = measure_moves(mesh, decoded, texels0, texels1);
  const double position_texels = moves.position / positions.texel_size;
  const double uv_texels = std::max(moves.texcoord0, moves.texcoord1);
  const auto is_quantised = [](const std::optional<Grid>& grid) { return grid && grid->is_quantised(); };
  if (decoded.triangles != triangles || (positions.grid.is_quantised() && position_texels > kPositionMoveTexels) ||
      (is_quantised(layout.texcoord0) && moves.texcoord0 > kUvMoveTexels) ||
      (is_quantised(layout.texcoord1) && moves.texcoord1 > kUvMoveTexels)) {
    return internal_error("mesh '" + mesh.name + "' does not survive its encoding: positions move by " +
                          std::to_string(position_texels) + " texels, texture coordinates by " +
                          std::to_string(uv_texels));
  }

  transfer.set_max_position_move_texels(std::max(transfer.max_position_move_texels(), position_texels));
  transfer.set_max_uv_move_texels(std::max(transfer.max_uv_move_texels(), uv_texels));
  if ((layout.texcoord0 && !layout.texcoord0->is_quantised()) ||
      (layout.texcoord1 && !layout.texcoord1->is_quantised())) {
    transfer.set_num_meshes_uv_unquantised(transfer.num_meshes_uv_unquantised() + 1);
  }
  *record.mutable_blob() = blobs.add(std::move(blob));
  return record;
}

/// Lights, and the profiles of luminaires: each once.
Result<void> add_lights(const Scene& scene, v1::SceneManifest& manifest) {
  std::map<const LightProfile*, std::uint32_t> index_of;
  for (const Light& light : scene.lights) {
    v1::Light& record = *manifest.add_lights();
    record = to_proto(light);
    const auto* luminaire = std::get_if<ProfileLight>(&light.kind);
    if (luminaire == nullptr) continue;
    const LightProfile* profile = luminaire->profile.get();
    if (profile == nullptr) return invalid_argument("light '" + light.name + "' has no profile");
    const auto [known, is_new] = index_of.emplace(profile, static_cast<std::uint32_t>(index_of.size()));
    if (is_new) *manifest.add_light_profiles() = to_proto(*profile);
    record.mutable_profile()->set_profile(known->second);
  }
  return {};
}

}  // namespace

Result<EncodedScene> encode_scene(const Scene& scene, const EncodeOptions& options) {
  RADBAKE_CHECK_LT(0.0, options.texels_per_meter);
  for (const Mesh& mesh : scene.meshes) RADBAKE_RETURN_IF_ERROR(check_mesh(scene, mesh));
  RADBAKE_ASSIGN_OR_RETURN(const PositionGrid positions,
                           choose_position_grid(scene, options.atlas_size, options.texels_per_meter));

  EncodedScene encoded;
  encoded.transfer.set_position_bits(static_cast<std::uint32_t>(positions.grid.bits));
  Blobs blobs;
  v1::SceneManifest manifest;
  *manifest.mutable_origin() = vector_to_proto(positions.origin);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    // A mesh whose triangles all use a vertex twice has nothing to bake.
    const Mesh& mesh = scene.meshes[i];
    if (canonical_triangles(mesh.triangles).empty()) continue;
    encoded.scene_meshes.push_back(static_cast<int>(i));
    RADBAKE_ASSIGN_OR_RETURN(*manifest.add_meshes(),
                             encode_and_verify(scene, mesh, positions, options.atlas_size, blobs, encoded.transfer));
  }
  for (const TexturePlane& plane : scene.textures) {
    RADBAKE_ASSIGN_OR_RETURN(std::string blob, encode_texture(plane));
    v1::Texture& record = *manifest.add_textures();
    record = to_proto(plane);
    *record.mutable_blob() = blobs.add(std::move(blob));
  }
  for (const Material& material : scene.materials) *manifest.add_materials() = to_proto(material);
  RADBAKE_RETURN_IF_ERROR(add_lights(scene, manifest));
  if (!(scene.sky == Vec3{})) *manifest.mutable_sky() = rgb_to_proto(scene.sky);
  if (scene.environment) {
    RADBAKE_ASSIGN_OR_RETURN(std::string blob, encode_environment(*scene.environment));
    *manifest.mutable_environment() = environment_to_proto(*scene.environment);
    *manifest.mutable_environment()->mutable_blob() = blobs.add(std::move(blob));
  }
  manifest.set_num_instances(scene.num_instances);

  const v1::Digest digest = blobs.add(manifest.SerializeAsString());
  encoded.manifest = {digest.sha256(), digest.size_bytes()};
  encoded.blobs = blobs.take();
  std::uint64_t num_bytes = 0;
  for (const EncodedBlob& blob : encoded.blobs) num_bytes += blob.bytes.size();
  encoded.transfer.set_encoded_bytes(num_bytes);
  return encoded;
}

}  // namespace radbake
