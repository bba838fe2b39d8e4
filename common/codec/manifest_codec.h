#pragma once

#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "radbake/v1/scene.pb.h"

namespace radbake {

/// What a manifest holds itself, to and from the wire. Reading trusts nothing: errors are kInvalidArgument and name the
/// record and the value.

v1::Material to_proto(const Material& material);
/// Without the index of a luminaire's profile, which only the manifest knows.
v1::Light to_proto(const Light& light);
v1::LightProfile to_proto(const LightProfile& profile);
v1::Rgb rgb_to_proto(Vec3 color);
v1::Vector3 vector_to_proto(Vec3 v);

/// Reflectance in [0, 1), transmittance in [0, 1] and together at most 1 (to 1e-6), emission finite and not negative,
/// textures below num_textures.
Result<Material> read_material(const v1::Material& material, int num_textures);

/// As check_profile(). `index`: for the message.
Result<std::shared_ptr<const LightProfile>> read_light_profile(const v1::LightProfile& profile, std::size_t index);

/// Finite values, directions of unit length, 0 <= inner cone <= outer cone <= pi/2, 0 <= angular diameter < pi, a
/// luminaire's profile among `profiles`.
Result<Light> read_light(const v1::Light& light, std::span<const std::shared_ptr<const LightProfile>> profiles);

/// Finite and not negative; absent: black.
Result<Vec3> read_sky(const v1::SceneManifest& manifest);

/// Finite.
Result<Vec3> read_origin(const v1::SceneManifest& manifest);

}  // namespace radbake
