#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "client/gltf/write_document.h"
#include "client/gltf/write_gltf.h"
#include "client/gltf/write_materials.h"
#include "client/gltf/write_vertices.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// Which scene mesh is a primitive's, and what was baked for it.
struct BakedPrimitive {
  const Mesh* mesh = nullptr;
  const std::vector<std::uint32_t>* scene_vertex = nullptr;
  const BakedMesh* baked = nullptr;
};

/// Writes primitives with their light. Values that several instances of a primitive share are written once.
class PrimitiveWriter {
 public:
  /// `max_irradiance`: of the scene, which COLOR_0 shows as 1; 0: no COLOR_0 is written. The document outlives this.
  PrimitiveWriter(Document& document, double max_irradiance) : document_(document), max_irradiance_(max_irradiance) {}

  /// Changes the copy `primitive` of a primitive of the file; says what it asks of its material.
  /// `origin`: mesh and primitive of the file.
  /// Errors: kInvalidArgument, kInternal: the file or the bake is not what it was.
  Result<MaterialUse> write(const BakedPrimitive& baked, std::pair<std::size_t, std::size_t> origin,
                            OrderedJson& primitive);

 private:
  /// What a primitive becomes for one way of splitting it: attributes, targets, indices and mode.
  struct Rewritten {
    std::vector<std::uint32_t> copied;
    FileTriangles triangles;
    OrderedJson members;
  };
  /// A primitive of the file, decoded if it was compressed.
  struct Original {
    std::size_t num_vertices = 0;
    FileTriangles triangles;
    std::map<std::string, Elements> decoded;  // attributes that were compressed
    bool is_compressed = false;
    std::vector<Rewritten> rewritten;
  };

  Result<Original*> original_of(std::pair<std::size_t, std::size_t> origin, const OrderedJson& primitive);
  void rewrite(Original& original, const WrittenVertices& vertices, OrderedJson& primitive);
  OrderedJson rewritten_members(const Original& original, const Rewritten& way, const OrderedJson& primitive);
  std::size_t rewritten_accessor(const Original& original, const std::string& name, std::size_t accessor,
                                 const std::vector<std::uint32_t>& copied);
  void write_texcoord1(const BakedPrimitive& baked, const WrittenVertices& vertices, OrderedJson& primitive,
                       MaterialUse& use);
  void write_irradiance(const BakedPrimitive& baked, const WrittenVertices& vertices, OrderedJson& primitive);
  void write_colors(const std::vector<std::array<float, 3>>& irradiance, OrderedJson& primitive);

  Document& document_;
  double max_irradiance_;
  std::map<std::pair<std::size_t, std::size_t>, Original> originals_;
};

}  // namespace radbake::gltf
