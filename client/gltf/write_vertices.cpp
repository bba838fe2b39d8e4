#include "client/gltf/write_vertices.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace radbake::gltf {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Error does_not_fit(const Mesh& mesh, const std::string& why) {
  return internal_error("the bake of mesh '" + mesh.name + "' does not fit the file: " + why);
}

/// The triangle from its smallest vertex on, in the same sense of rotation.
Triangle rotated(Triangle triangle) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangle;
}

/// Baked triangles by the scene's vertices that they copy, each to be taken once.
class BakedTriangles {
 public:
  explicit BakedTriangles(const BakedMesh& baked) : baked_(baked) {
    for (std::uint32_t i = 0; i < baked.triangles.size(); ++i) {
      const auto& [a, b, c] = baked.triangles[i];
      by_source_.push_back({rotated({source(a), source(b), source(c)}), i});
    }
    std::sort(by_source_.begin(), by_source_.end());
    is_taken_.resize(by_source_.size());
  }

  /// Null if there is none left that copies the scene's triangle.
  const Triangle* take(const Triangle& scene_triangle) {
    const Triangle key = rotated(scene_triangle);
    auto it = std::lower_bound(by_source_.begin(), by_source_.end(), std::pair(key, std::uint32_t{0}));
    for (; it != by_source_.end() && it->first == key; ++it) {
      const auto at = static_cast<std::size_t>(it - by_source_.begin());
      if (is_taken_[at]) continue;
      is_taken_[at] = true;
      return &baked_.triangles[it->second];
    }
    return nullptr;
  }

  std::uint32_t source(std::uint32_t vertex) const { return baked_.source_vertices[vertex]; }

 private:
  const BakedMesh& baked_;
  std::vector<std::pair<Triangle, std::uint32_t>> by_source_;
  std::vector<bool> is_taken_;
};

bool is_same_set(Triangle a, Triangle b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  return a == b;
}

Triangle mapped(const Triangle& triangle, std::span<const std::uint32_t> scene_vertex) {
  return {scene_vertex[triangle[0]], scene_vertex[triangle[1]], scene_vertex[triangle[2]]};
}

}  // namespace

Result<WrittenVertices> written_vertices(const FileTriangles& file, std::span<const std::uint32_t> scene_vertex,
                                         const Mesh& scene_mesh, const BakedMesh& baked) {
  WrittenVertices written;
  written.baked.assign(scene_vertex.begin(), scene_vertex.end());
  if (baked.source_vertices.empty()) return written;

  // The scene's vertices keep their numbers in the bake; which file vertices have it is known, copies are to come.
  if (baked.triangles.size() != scene_mesh.triangles.size()) {
    return does_not_fit(scene_mesh, std::to_string(baked.triangles.size()) + " baked triangles for " +
                                        std::to_string(scene_mesh.triangles.size()));
  }
  const auto num_own = static_cast<std::uint32_t>(scene_mesh.positions.size());
  BakedTriangles triangles(baked);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> copies;  // (of the file, of the bake) -> written
  std::size_t next = 0;  // the scene's triangles are the file's in the same order, some left out
  written.triangles.reserve(file.size());
  for (const Triangle& corners : file) {
    Triangle& out = written.triangles.emplace_back(corners);
    if (next == scene_mesh.triangles.size()) continue;
    const Triangle& scene_triangle = scene_mesh.triangles[next];
    if (!is_same_set(mapped(corners, scene_vertex), scene_triangle)) continue;
    const Triangle* const split = triangles.take(scene_triangle);
    if (split == nullptr) {
      return does_not_fit(scene_mesh, "triangle " + std::to_string(next) + " was not baked");
    }
    ++next;
    for (std::uint32_t& vertex : out) {
      const std::uint32_t own = scene_vertex[vertex];
      const auto* const baked_vertex = std::find_if(
          split->begin(), split->end(), [&](std::uint32_t candidate) { return triangles.source(candidate) == own; });
      // The bake's first vertices are the scene's.
      if (*baked_vertex < num_own) continue;
      const auto [it, is_new] =
          copies.try_emplace({vertex, *baked_vertex}, static_cast<std::uint32_t>(written.baked.size()));
      if (is_new) {
        written.copied.push_back(vertex);
        written.baked.push_back(*baked_vertex);
      }
      vertex = it->second;
    }
  }
  if (next != scene_mesh.triangles.size()) {
    return does_not_fit(scene_mesh, "triangle " + std::to_string(next) + " is not in it");
  }
  return written;
}

}  // namespace radbake::gltf
