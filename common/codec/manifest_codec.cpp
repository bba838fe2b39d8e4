#include "common/codec/manifest_codec.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>

namespace radbake {
namespace {

// A direction may have been rounded to float32: relative 6e-8 a component, and to spare.
constexpr double kUnitLengthTolerance = 1e-6;
// What a sheet reflects and lets through are shares of one: rounded once to double, or once to float32 on the way.
constexpr double kShareTolerance = 1e-6;

std::string describe(double value) {
  std::ostringstream out;
  out.precision(9);
  out << value;
  return out.str();
}

std::string describe(Vec3 v) { return "(" + describe(v.x) + ", " + describe(v.y) + ", " + describe(v.z) + ")"; }

Vec3 to_vec(const v1::Rgb& rgb) { return {rgb.r(), rgb.g(), rgb.b()}; }
Vec3 to_vec(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// What goes straight through; absent: nothing. In each channel 0 to 1, and with the reflectance no more than 1.
Result<Vec3> read_transmittance(const v1::Rgb& rgb, Vec3 reflectance, const std::string& owner) {
  const Vec3 share = to_vec(rgb);
  if (!is_finite(share) || min_component(share) < 0 || max_component(share) > 1) {
    return invalid_argument(owner + " has transmittance " + describe(share) + ": each channel must be from 0 to 1");
  }
  if (max_component(reflectance + share) <= 1 + kShareTolerance) return share;
  return invalid_argument(owner + " reflects " + describe(reflectance) + " and lets " + describe(share) +
                          " through: more than 1 together");
}

/// What goes through scattered; absent: nothing. What is reflected and this stay below 1 together.
Result<Vec3> read_diffuse_transmittance(const v1::Rgb& rgb, Vec3 reflectance, const std::string& owner) {
  const Vec3 share = to_vec(rgb);
  if (is_finite(share) && min_component(share) >= 0 && max_component(reflectance + share) < 1) return share;
  return invalid_argument(owner + " reflects " + describe(reflectance) + " and scatters " + describe(share) +
                          " through: each must be at least 0, and both together below 1");
}

/// A colour of light: finite and not negative. `owner` and `what` are for the message.
Result<Vec3> read_light_color(const v1::Rgb& rgb, const std::string& owner, const char* what) {
  const Vec3 color = to_vec(rgb);
  if (is_finite(color) && min_component(color) >= 0) return color;
  return invalid_argument(owner + " has " + what + " " + describe(color) + ": must be finite and not negative");
}

Result<Vec3> read_position(const v1::Vector3& vector, const std::string& owner) {
  const Vec3 position = to_vec(vector);
  if (is_finite(position)) return position;
  return invalid_argument(owner + " has position " + describe(position) + ": must be finite");
}

Result<Vec3> read_direction(const v1::Vector3& vector, const std::string& owner) {
  const Vec3 direction = to_vec(vector);
  if (std::abs(length(direction) - 1) <= kUnitLengthTolerance) return direction;
  return invalid_argument(owner + " has direction " + describe(direction) + ": must be of length 1");
}

void write_reference(const std::optional<TextureReference>& reference, auto mutable_reference) {
  if (!reference) return;
  v1::TextureReference* out = mutable_reference();
  out->set_texture(static_cast<std::uint32_t>(reference->texture));
  out->set_texcoord(static_cast<std::uint32_t>(reference->texcoord));
  if (reference->transform == UvTransform{}) return;
  const auto write = [](Vec2 v, v1::Vector2* message) {
    message->set_x(v.x);
    message->set_y(v.y);
  };
  write(reference->transform.x_axis, out->mutable_transform()->mutable_x_axis());
  write(reference->transform.y_axis, out->mutable_transform()->mutable_y_axis());
  write(reference->transform.offset, out->mutable_transform()->mutable_offset());
}

Result<TextureReference> read_reference(const v1::TextureReference& reference, int num_textures,
                                        const std::string& owner) {
  if (reference.texture() >= static_cast<std::uint32_t>(num_textures)) {
    return invalid_argument(owner + " uses texture " + std::to_string(reference.texture()) + " of " +
                            std::to_string(num_textures));
  }
  if (reference.texcoord() > 1) {
    return invalid_argument(owner + " uses texcoord " + std::to_string(reference.texcoord()) + ": there are 0 and 1");
  }
  TextureReference out{static_cast<int>(reference.texture()), static_cast<int>(reference.texcoord())};
  if (!reference.has_transform()) return out;
  const v1::UvTransform& transform = reference.transform();
  out.transform.x_axis = {transform.x_axis().x(), transform.x_axis().y()};
  out.transform.y_axis = {transform.y_axis().x(), transform.y_axis().y()};
  out.transform.offset = {transform.offset().x(), transform.offset().y()};
  if (out.transform.is_within_float()) return out;
  const auto in_words = [](Vec2 v) { return "(" + describe(v.x) + ", " + describe(v.y) + ")"; };
  return invalid_argument(owner + " transforms texture coordinates by " + in_words(out.transform.x_axis) + ", " +
                          in_words(out.transform.y_axis) + " and " + in_words(out.transform.offset) +
                          ": must be finite in single precision");
}

}  // namespace

v1::Rgb rgb_to_proto(Vec3 color) {
  v1::Rgb out;
  out.set_r(color.x);
  out.set_g(color.y);
  out.set_b(color.z);
  return out;
}

v1::Vector3 vector_to_proto(Vec3 v) {
  v1::Vector3 out;
  out.set_x(v.x);
  out.set_y(v.y);
  out.set_z(v.z);
  return out;
}

v1::Material to_proto(const Material& material) {
  v1::Material out;
  out.set_name(material.name);
  *out.mutable_reflectance() = rgb_to_proto(material.reflectance);
  write_reference(material.reflectance_texture, [&] { return out.mutable_reflectance_texture(); });
  *out.mutable_emissive() = rgb_to_proto(material.emissive);
  write_reference(material.emissive_texture, [&] { return out.mutable_emissive_texture(); });
  out.set_double_sided(material.is_double_sided);
  // The enumerators have the same order.
  out.set_alpha_mode(static_cast<v1::AlphaMode>(material.alpha_mode));
  out.set_alpha(material.alpha);
  out.set_alpha_cutoff(material.alpha_cutoff);
  if (!(material.transmittance == Vec3{})) *out.mutable_transmittance() = rgb_to_proto(material.transmittance);
  if (!(material.diffuse_transmittance == Vec3{})) {
    *out.mutable_diffuse_transmittance() = rgb_to_proto(material.diffuse_transmittance);
    write_reference(material.diffuse_transmittance_texture,
                    [&] { return out.mutable_diffuse_transmittance_texture(); });
  }
  out.set_is_specular(material.is_specular);
  out.set_is_refractive(material.is_refractive);
  out.set_has_normal_map(material.has_normal_map);
  out.set_has_volume(material.has_volume);
  return out;
}

v1::Light to_proto(const Light& light) {
  v1::Light out;
  out.set_name(light.name);
  std::visit(
      [&](const auto& kind) {
        using Kind = std::decay_t<decltype(kind)>;
        // NOLINTNEXTLINE(bugprone-branch-clone): branches that are not compiled look equal to it
        if constexpr (std::is_same_v<Kind, PointLight>) {
          *out.mutable_point()->mutable_position() = vector_to_proto(kind.position);
          *out.mutable_point()->mutable_intensity() = rgb_to_proto(kind.intensity);
        } else if constexpr (std::is_same_v<Kind, SpotLight>) {
          *out.mutable_spot()->mutable_position() = vector_to_proto(kind.position);
          *out.mutable_spot()->mutable_direction() = vector_to_proto(kind.direction);
          *out.mutable_spot()->mutable_intensity() = rgb_to_proto(kind.intensity);
          out.mutable_spot()->set_inner_cone_radians(kind.inner_cone_radians);
          out.mutable_spot()->set_outer_cone_radians(kind.outer_cone_radians);
        } else if constexpr (std::is_same_v<Kind, ProfileLight>) {
          v1::ProfileLight& profile = *out.mutable_profile();
          *profile.mutable_position() = vector_to_proto(kind.position);
          *profile.mutable_direction() = vector_to_proto(kind.direction);
          *profile.mutable_zero_side() = vector_to_proto(kind.zero_side);
          *profile.mutable_tint() = rgb_to_proto(kind.tint);
          profile.set_is_mirrored(kind.is_mirrored);
        } else {
          *out.mutable_directional()->mutable_direction() = vector_to_proto(kind.direction);
          *out.mutable_directional()->mutable_illuminance() = rgb_to_proto(kind.illuminance);
          out.mutable_directional()->set_angular_diameter_radians(kind.angular_diameter_radians);
        }
      },
      light.kind);
  return out;
}

v1::LightProfile to_proto(const LightProfile& profile) {
  v1::LightProfile out;
  out.mutable_vertical_degrees()->Add(profile.vertical_degrees.begin(), profile.vertical_degrees.end());
  out.mutable_horizontal_degrees()->Add(profile.horizontal_degrees.begin(), profile.horizontal_degrees.end());
  out.mutable_candela()->Add(profile.candela.begin(), profile.candela.end());
  return out;
}

Result<Material> read_material(const v1::Material& material, int num_textures) {
  const std::string owner = "material '" + material.name() + "'";
  Material out;
  out.name = material.name();
  out.reflectance = to_vec(material.reflectance());
  if (!is_finite(out.reflectance) || min_component(out.reflectance) < 0 || max_component(out.reflectance) >= 1) {
    return invalid_argument(owner + " has reflectance " + describe(out.reflectance) +
                            ": each channel must be at least 0 and below 1");
  }
  RADBAKE_ASSIGN_OR_RETURN(out.emissive, read_light_color(material.emissive(), owner, "emission"));
  if (material.has_reflectance_texture()) {
    RADBAKE_ASSIGN_OR_RETURN(out.reflectance_texture,
                             read_reference(material.reflectance_texture(), num_textures, owner));
  }
  if (material.has_emissive_texture()) {
    RADBAKE_ASSIGN_OR_RETURN(out.emissive_texture, read_reference(material.emissive_texture(), num_textures, owner));
  }
  out.is_double_sided = material.double_sided();
  if (!v1::AlphaMode_IsValid(material.alpha_mode())) {
    return invalid_argument(owner + " has alpha mode " + std::to_string(material.alpha_mode()) + ": not known");
  }
  out.alpha_mode = static_cast<AlphaMode>(material.alpha_mode());
  out.alpha = material.alpha();
  if (!(out.alpha >= 0 && out.alpha <= 1)) {
    return invalid_argument(owner + " has alpha " + describe(out.alpha) + ": must be from 0 to 1");
  }
  out.alpha_cutoff = material.alpha_cutoff();
  if (!(out.alpha_cutoff >= 0 && std::isfinite(out.alpha_cutoff))) {
    return invalid_argument(owner + " has alpha cutoff " + describe(out.alpha_cutoff) +
                            ": must be finite and not negative");
  }
  RADBAKE_ASSIGN_OR_RETURN(out.transmittance, read_transmittance(material.transmittance(), out.reflectance, owner));
  RADBAKE_ASSIGN_OR_RETURN(out.diffuse_transmittance,
                           read_diffuse_transmittance(material.diffuse_transmittance(), out.reflectance, owner));
  if (material.has_diffuse_transmittance_texture()) {
    RADBAKE_ASSIGN_OR_RETURN(out.diffuse_transmittance_texture,
                             read_reference(material.diffuse_transmittance_texture(), num_textures, owner));
  }
  out.is_specular = material.is_specular();
  out.is_refractive = material.is_refractive();
  out.has_normal_map = material.has_normal_map();
  out.has_volume = material.has_volume();
  return out;
}

Result<std::shared_ptr<const LightProfile>> read_light_profile(const v1::LightProfile& profile, std::size_t index) {
  LightProfile out{{profile.vertical_degrees().begin(), profile.vertical_degrees().end()},
                   {profile.horizontal_degrees().begin(), profile.horizontal_degrees().end()},
                   {profile.candela().begin(), profile.candela().end()}};
  const Result<void> checked = check_profile(out);
  if (!checked.ok()) return invalid_argument("light profile " + std::to_string(index) + ": " + checked.error().message);
  return std::make_shared<const LightProfile>(std::move(out));
}

namespace {

using Profiles = std::span<const std::shared_ptr<const LightProfile>>;

Result<ProfileLight> read_luminaire(const v1::ProfileLight& profile, Profiles profiles, const std::string& owner) {
  ProfileLight out;
  RADBAKE_ASSIGN_OR_RETURN(out.position, read_position(profile.position(), owner));
  RADBAKE_ASSIGN_OR_RETURN(out.direction, read_direction(profile.direction(), owner));
  RADBAKE_ASSIGN_OR_RETURN(out.zero_side, read_direction(profile.zero_side(), owner));
  if (std::abs(dot(out.direction, out.zero_side)) > kUnitLengthTolerance) {
    return invalid_argument(owner + " has a zero side " + describe(out.zero_side) +
                            " that is not at right angles to its direction " + describe(out.direction));
  }
  RADBAKE_ASSIGN_OR_RETURN(out.tint, read_light_color(profile.tint(), owner, "tint"));
  if (profile.profile() >= profiles.size()) {
    return invalid_argument(owner + " has profile " + std::to_string(profile.profile()) + " of " +
                            std::to_string(profiles.size()));
  }
  out.profile = profiles[profile.profile()];
  out.is_mirrored = profile.is_mirrored();
  return out;
}

}  // namespace

Result<Light> read_light(const v1::Light& light, Profiles profiles) {
  const std::string owner = "light '" + light.name() + "'";
  Light out;
  out.name = light.name();
  if (light.has_point()) {
    PointLight point;
    RADBAKE_ASSIGN_OR_RETURN(point.position, read_position(light.point().position(), owner));
    RADBAKE_ASSIGN_OR_RETURN(point.intensity, read_light_color(light.point().intensity(), owner, "intensity"));
    out.kind = point;
  } else if (light.has_spot()) {
    SpotLight spot;
    RADBAKE_ASSIGN_OR_RETURN(spot.position, read_position(light.spot().position(), owner));
    RADBAKE_ASSIGN_OR_RETURN(spot.direction, read_direction(light.spot().direction(), owner));
    RADBAKE_ASSIGN_OR_RETURN(spot.intensity, read_light_color(light.spot().intensity(), owner, "intensity"));
    spot.inner_cone_radians = light.spot().inner_cone_radians();
    spot.outer_cone_radians = light.spot().outer_cone_radians();
    if (!(spot.inner_cone_radians >= 0 && spot.inner_cone_radians <= spot.outer_cone_radians &&
          spot.outer_cone_radians <= std::numbers::pi / 2)) {
      return invalid_argument(owner + " has cones of " + describe(spot.inner_cone_radians) + " and " +
                              describe(spot.outer_cone_radians) +
                              " rad: must be 0 <= inner cone <= outer cone <= pi/2");
    }
    out.kind = spot;
  } else if (light.has_directional()) {
    DirectionalLight sun;
    RADBAKE_ASSIGN_OR_RETURN(sun.direction, read_direction(light.directional().direction(), owner));
    RADBAKE_ASSIGN_OR_RETURN(sun.illuminance,
                             read_light_color(light.directional().illuminance(), owner, "illuminance"));
    sun.angular_diameter_radians = light.directional().angular_diameter_radians();
    if (!(sun.angular_diameter_radians >= 0 && sun.angular_diameter_radians < std::numbers::pi)) {
      return invalid_argument(owner + " has an angular diameter of " + describe(sun.angular_diameter_radians) +
                              " rad: must be at least 0 and below pi");
    }
    out.kind = sun;
  } else if (light.has_profile()) {
    RADBAKE_ASSIGN_OR_RETURN(out.kind, read_luminaire(light.profile(), profiles, owner));
  } else {
    return invalid_argument(owner + " is of no kind that this version knows");
  }
  return out;
}

Result<Vec3> read_sky(const v1::SceneManifest& manifest) {
  return read_light_color(manifest.sky(), "the sky", "luminance");
}

Result<Vec3> read_origin(const v1::SceneManifest& manifest) { return read_position(manifest.origin(), "the origin"); }

}  // namespace radbake
