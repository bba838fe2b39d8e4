#include "client/gltf/write_primitive.h"

#include <algorithm>
#include <set>
#include <string>

#include "client/gltf/entry.h"
#include "client/gltf/primitive_triangles.h"
#include "client/gltf/write_draco.h"

namespace radbake::gltf {
namespace {

constexpr char kDraco[] = "KHR_draco_mesh_compression";

bool keeps_own_uvs(const BakedMesh& baked) {
  return baked.uvs.empty() && baked.uv_scale == Vec2{1, 1} && baked.uv_offset == Vec2{};
}

std::vector<std::uint32_t> indices_of(const Elements& elements) {
  std::vector<std::uint32_t> indices(elements.count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    indices[i] = static_cast<std::uint32_t>(component(elements, i, 0));
  }
  return indices;
}

/// The next TEXCOORD that the primitive has not got, above 1.
int free_texcoord(const OrderedJson& attributes) {
  int n = 2;
  while (attributes.contains("TEXCOORD_" + std::to_string(n))) ++n;
  return n;
}

/// Gives an attribute another name, with its displacements in morph targets. The old name is free then.
void rename_attribute(OrderedJson& primitive, const std::string& from, const std::string& to) {
  const auto rename = [&](OrderedJson& attributes) {
    if (!attributes.contains(from)) return;
    const OrderedJson accessor = attributes[from];
    attributes.erase(from);
    attributes[to] = accessor;
  };
  rename(primitive["attributes"]);
  if (!primitive.contains("targets")) return;
  for (OrderedJson& target : primitive["targets"]) rename(target);
}

/// glTF counts TEXCOORDs from 0 without a gap.
void fill_texcoord0(OrderedJson& attributes) {
  if (attributes.contains("TEXCOORD_0")) return;
  const OrderedJson same = attributes["TEXCOORD_1"];
  attributes["TEXCOORD_0"] = same;
}

}  // namespace

Result<PrimitiveWriter::Original*> PrimitiveWriter::original_of(std::pair<std::size_t, std::size_t> origin,
                                                                const OrderedJson& primitive) {
  const auto [it, is_new] = originals_.try_emplace(origin);
  Original& original = it->second;
  if (!is_new) return &original;
  const OrderedJson& attributes = primitive.at("attributes");
  if (primitive.contains("extensions") && primitive["extensions"].contains(kDraco)) {
    const OrderedJson& draco = primitive["extensions"][kDraco];
    std::map<std::string, DracoAttribute> wanted;
    for (const auto& [name, id] : draco.at("attributes").items()) {
      const OrderedJson& accessor = document_.json.at("accessors").at(attributes.at(name).get<std::size_t>());
      wanted[name] = {id.get<std::uint32_t>(),
                      {accessor.at("componentType").get<int>(),
                       accessor.at("type").get<std::string>(),
                       accessor.value("normalized", false),
                       0,
                       {}}};
    }
    const auto view = draco.at("bufferView").get<std::size_t>();
    Result<DracoElements> decoded = decode_draco_elements(document_.view_bytes(view), wanted);
    if (!decoded.ok()) return invalid_argument(numbered("buffer view", view) + ": " + decoded.error().message);
    original.is_compressed = true;
    original.decoded = std::move(decoded->attributes);
    original.triangles = std::move(decoded->triangles);
    original.num_vertices = original.decoded.at("POSITION").count;
    return &original;
  }
  original.num_vertices =
      document_.json.at("accessors").at(attributes.at("POSITION").get<std::size_t>()).at("count").get<std::size_t>();
  const std::vector<std::uint32_t> corners =
      primitive.contains("indices") ? indices_of(document_.elements(primitive["indices"].get<std::size_t>()))
                                    : consecutive_corners(original.num_vertices);
  RADBAKE_ASSIGN_OR_RETURN(
      original.triangles, primitive_triangles(primitive.value("mode", kModeTriangles), corners, original.num_vertices));
  return &original;
}

std::size_t PrimitiveWriter::rewritten_accessor(const Original& original, const std::string& name, std::size_t accessor,
                                                const std::vector<std::uint32_t>& copied) {
  const auto decoded = original.decoded.find(name);
  Elements elements = decoded != original.decoded.end() ? decoded->second : document_.elements(accessor);
  if (elements.count != original.num_vertices) throw std::out_of_range(name + " has another number of values");
  const OrderedJson like = document_.json["accessors"][accessor];
  return document_.add_accessor(with_copies(std::move(elements), copied), Document::Use::kVertices, like,
                                name == "POSITION");
}

OrderedJson PrimitiveWriter::rewritten_members(const Original& original, const Rewritten& way,
                                               const OrderedJson& primitive) {
  OrderedJson members = {{"attributes", primitive["attributes"]}};
  for (auto& [name, accessor] : members["attributes"].items()) {
    const bool stays = way.copied.empty() && !original.decoded.contains(name);
    if (!stays) accessor = rewritten_accessor(original, name, accessor.get<std::size_t>(), way.copied);
  }
  if (primitive.contains("targets") && !way.copied.empty()) {
    members["targets"] = primitive["targets"];
    Original targets;  // morph targets are never compressed
    targets.num_vertices = original.num_vertices;
    for (OrderedJson& target : members["targets"]) {
      for (auto& [name, accessor] : target.items()) {
        accessor = rewritten_accessor(targets, name, accessor.get<std::size_t>(), way.copied);
      }
    }
  }
  const OrderedJson like = primitive.contains("indices")
                               ? document_.json["accessors"].at(primitive["indices"].get<std::size_t>())
                               : OrderedJson();
  members["indices"] = document_.add_accessor(index_elements(way.triangles, original.num_vertices + way.copied.size()),
                                              Document::Use::kIndices, like, false);
  members["mode"] = kModeTriangles;
  return members;
}

// Writes attributes, targets and indices anew with the copies of vertices, uncompressed, the triangles as a list.
void PrimitiveWriter::rewrite(Original& original, const WrittenVertices& vertices, OrderedJson& primitive) {
  const FileTriangles& triangles = vertices.is_split() ? vertices.triangles : original.triangles;
  auto known = std::find_if(original.rewritten.begin(), original.rewritten.end(), [&](const Rewritten& way) {
    return way.copied == vertices.copied && way.triangles == triangles;
  });
  if (known == original.rewritten.end()) {
    Rewritten way{vertices.copied, triangles, {}};
    way.members = rewritten_members(original, way, primitive);
    known = original.rewritten.insert(known, std::move(way));
  }
  primitive.update(known->members);
  if (!original.is_compressed) return;
  primitive["extensions"].erase(kDraco);
  if (primitive["extensions"].empty()) primitive.erase("extensions");
}

void PrimitiveWriter::write_texcoord1(const BakedPrimitive& baked, const WrittenVertices& vertices,
                                      OrderedJson& primitive, MaterialUse& use) {
  OrderedJson& attributes = primitive["attributes"];
  if (!keeps_own_uvs(*baked.baked) || !attributes.contains("TEXCOORD_1")) {
    std::vector<std::array<float, 2>> uvs;
    uvs.reserve(vertices.baked.size());
    for (const std::uint32_t vertex : vertices.baked) {
      if (vertex == kNoVertex) {
        uvs.push_back({0, 0});
      } else if (!baked.baked->uvs.empty()) {
        uvs.push_back(baked.baked->uvs[vertex]);
      } else {
        const std::uint32_t source =
            baked.baked->source_vertices.empty() ? vertex : baked.baked->source_vertices[vertex];
        const Vec2 own = baked.mesh->texcoord1[source], scale = baked.baked->uv_scale, offset = baked.baked->uv_offset;
        uvs.push_back({static_cast<float>(scale.x * own.x + offset.x), static_cast<float>(scale.y * own.y + offset.y)});
      }
    }
    // What was there may be looked up by the material's textures, or by somebody's program.
    if (attributes.contains("TEXCOORD_1")) {
      use.moved_texcoord1 = free_texcoord(attributes);
      rename_attribute(primitive, "TEXCOORD_1", "TEXCOORD_" + std::to_string(use.moved_texcoord1));
    }
    attributes["TEXCOORD_1"] = document_.add_accessor(elements_of(uvs), Document::Use::kVertices, {}, false);
  }
  fill_texcoord0(attributes);
}

void PrimitiveWriter::write_irradiance(const BakedPrimitive& baked, const WrittenVertices& vertices,
                                       OrderedJson& primitive) {
  std::vector<std::array<float, 3>> irradiance;
  irradiance.reserve(vertices.baked.size());
  for (const std::uint32_t vertex : vertices.baked) {
    irradiance.push_back(vertex == kNoVertex ? std::array<float, 3>{} : baked.baked->irradiance[vertex]);
  }
  primitive["attributes"]["_IRRADIANCE"] =
      document_.add_accessor(elements_of(irradiance), Document::Use::kVertices, {}, false);
  if (max_irradiance_ > 0) write_colors(irradiance, primitive);
}

// COLOR_0 multiplies the base colour: with the colours that were there it becomes their product with the light, and
// they stay as _COLOR_0_SOURCE.
void PrimitiveWriter::write_colors(const std::vector<std::array<float, 3>>& irradiance, OrderedJson& primitive) {
  OrderedJson& attributes = primitive["attributes"];
  if (attributes.contains("COLOR_0") && !attributes.contains("_COLOR_0_SOURCE")) {
    rename_attribute(primitive, "COLOR_0", "_COLOR_0_SOURCE");
  }
  Elements source;
  if (attributes.contains("_COLOR_0_SOURCE")) {
    source = document_.elements(attributes["_COLOR_0_SOURCE"].get<std::size_t>());
    if (source.count != irradiance.size()) throw std::out_of_range("COLOR_0 has another number of values");
  }
  const std::size_t n = source.count > 0 ? num_components(source.type) : 0;
  std::vector<std::array<float, 4>> colors;
  for (std::size_t i = 0; i < irradiance.size(); ++i) {
    std::array<float, 4> color{0, 0, 0, n == 4 ? static_cast<float>(component(source, i, 3)) : 1};
    for (std::size_t c = 0; c < 3; ++c) {
      const double tint = c < n ? component(source, i, c) : 1;
      color[c] = static_cast<float>(std::clamp(irradiance[i][c] / max_irradiance_ * tint, 0.0, 1.0));
    }
    colors.push_back(color);
  }
  attributes["COLOR_0"] = document_.add_accessor(elements_of(colors), Document::Use::kVertices, {}, false);
}

Result<MaterialUse> PrimitiveWriter::write(const BakedPrimitive& baked, std::pair<std::size_t, std::size_t> origin,
                                           OrderedJson& primitive) {
  const BakedMesh& mesh = *baked.baked;
  MaterialUse use;
  use.lightmap = mesh.lightmap;
  const bool is_split = !mesh.source_vertices.empty();
  const bool gets_uvs =
      mesh.lightmap >= 0 && (!keeps_own_uvs(mesh) || !primitive.at("attributes").contains("TEXCOORD_1"));
  if (is_split || gets_uvs || !mesh.irradiance.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(Original* const original, original_of(origin, primitive));
    if (original->num_vertices != baked.scene_vertex->size()) {
      return internal_error("the bake of mesh '" + baked.mesh->name + "' does not fit the file: it has " +
                            std::to_string(original->num_vertices) + " vertices, and " +
                            std::to_string(baked.scene_vertex->size()) + " were read");
    }
    RADBAKE_ASSIGN_OR_RETURN(const WrittenVertices vertices,
                             written_vertices(original->triangles, *baked.scene_vertex, *baked.mesh, mesh));
    if (is_split || original->is_compressed) rewrite(*original, vertices, primitive);
    if (mesh.lightmap >= 0) write_texcoord1(baked, vertices, primitive, use);
    if (!mesh.irradiance.empty()) write_irradiance(baked, vertices, primitive);
  } else if (mesh.lightmap >= 0) {
    fill_texcoord0(primitive["attributes"]);
  }
  return use;
}

}  // namespace radbake::gltf
