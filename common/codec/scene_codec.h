#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/scene/scene.h"
#include "radbake/v1/result.pb.h"
#include "radbake/v1/scene.pb.h"
#include "radbake/v1/server.pb.h"

namespace radbake {

/// One blob to upload.
struct EncodedBlob {
  Digest digest;
  std::string bytes;
};

/// A scene as it goes over the wire: the manifest is blobs.back().
struct EncodedScene {
  Digest manifest;
  std::vector<EncodedBlob> blobs;  ///< unique digests: meshes, textures, the manifest last
  std::vector<int> scene_meshes;   ///< [manifest.meshes] index into Scene::meshes
  v1::MeshTransfer transfer;       ///< what quantisation did, measured by decoding again
};

struct EncodeOptions {
  int atlas_size = 0;            ///< as asked; 0: texel size comes from texels_per_meter
  double texels_per_meter = 32;  ///< positive; used where there is no atlas size or no texcoord1
};

/// Encodes a scene: meshes by Draco (edgebreaker), textures as float32 planes, the rest as a SceneManifest.
///
/// Positions go on one explicit grid for the whole scene: the coarsest whose step is a power of two that moves no
/// position by more than 1/1000 of the scene's 5th-percentile texel; where that takes more than 24 bits, no mesh's
/// positions are quantised. Texture coordinates likewise, mesh by mesh: none moves by more than 1/100 texel of what it
/// looks up (without an atlas size: of 4096), else it goes unquantised. All bounds are checked on the decoded blobs,
/// not assumed. Triangles that use a vertex twice are not sent, and neither are meshes of nothing else.
///
/// Errors: kInvalidArgument for an empty scene or a mesh that Draco refuses.
Result<EncodedScene> encode_scene(const Scene& scene, const EncodeOptions& options);

/// Reads a blob by its digest; the decoder checks neither size nor digest again.
using BlobReader = std::function<Result<std::string>(const Digest&)>;

/// Decodes a manifest and its blobs. Input is not trusted: counts are held against the limits before memory is taken,
/// and each Draco header against the manifest before it is decoded.
///
/// Vertices come back in their original order, triangles sorted by original vertex ids (smallest id first in each),
/// so the result does not depend on Draco's order. Positions are world metres in double.
/// Errors: kInvalidArgument or kResourceExhausted, naming mesh, accessor and value.
Result<Scene> decode_scene(const std::string& manifest, const BlobReader& read_blob, const v1::Limits& limits);

/// The limits of a server that was not configured otherwise.
v1::Limits default_limits();

}  // namespace radbake
