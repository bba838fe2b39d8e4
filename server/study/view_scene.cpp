#include "server/study/view_scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <utility>

#include "client/gltf/read_gltf.h"
#include "client/image/decode_image.h"
#include "client/image/srgb.h"
#include "server/radiosity/survey/surface_opacity.h"
#include "server/radiosity/survey/survey.h"
#include "server/radiosity/threads/for_each_range.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::study {
namespace {

using radiosity::Hit;
using radiosity::Ray;
using radiosity::SurfacePoint;
using radiosity::Surfaces;

/// A whole number of an object, -1 where it has none.
int whole_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_integer() ? found->get<int>() : -1;
}

/// A text of an object, or another where it has none.
std::string text_of(const nlohmann::json& object, const char* key, const std::string& otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

Result<nlohmann::json> read_json(const std::filesystem::path& path) {
  std::ifstream file(path);
  nlohmann::json document = nlohmann::json::parse(file, nullptr, false);
  if (!document.is_object() || !document["lightmaps"].is_array() || !document["meshes"].is_array()) {
    return invalid_argument(path.string() + " is missing or is not what radbake writes");
  }
  return document;
}

/// Primitives by node and place in its mesh: of placed meshes, scene.glb has copies.
using Primitive = std::pair<int, int>;

std::map<Primitive, int> lightmaps_of(const nlohmann::json& document) {
  std::map<Primitive, int> out;
  for (const nlohmann::json& mesh : document["meshes"]) {
    out[{whole_of(mesh, "node"), whole_of(mesh, "primitive")}] = whole_of(mesh, "lightmap");
  }
  return out;
}

std::string exr_of(const nlohmann::json& lightmap) {
  const auto files = lightmap.find("files");
  if (files == lightmap.end()) return "";
  for (const nlohmann::json& file : *files) {
    if (text_of(file, "encoding", "") == "exr") return text_of(file, "file", "");
  }
  return "";
}

/// Bilinear, clamped at the border. uv: (0, 0) is the top left corner.
Vec3 looked_up(const image::Pixels& map, Vec2 uv) {
  const double x = std::clamp(uv.x * map.width - 0.5, 0.0, map.width - 1.0);
  const double y = std::clamp(uv.y * map.height - 0.5, 0.0, map.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, map.width - 1), y1 = std::min(y0 + 1, map.height - 1);
  const double fx = x - x0, fy = y - y0;
  const auto at = [&](int px, int py) {
    const float* texel = &map.values[(static_cast<std::size_t>(py) * static_cast<std::size_t>(map.width) +
                                      static_cast<std::size_t>(px)) *
                                     static_cast<std::size_t>(map.channels)];
    return Vec3{texel[0], texel[1], texel[2]};
  };
  return (at(x0, y0) * (1 - fx) + at(x1, y0) * fx) * (1 - fy) + (at(x0, y1) * (1 - fx) + at(x1, y1) * fx) * fy;
}

/// Directions through the picture.
class Lens {
 public:
  Lens(const Camera& camera, const ViewOptions& options)
      : forward_(normalized(camera.target - camera.eye)),
        right_(normalized(cross(forward_, camera.up))),
        up_(cross(right_, forward_)),
        width_(options.width),
        height_(options.height),
        tangent_(std::tan(camera.fov_degrees * std::numbers::pi / 360) * 2 / std::max(options.width, options.height)) {}

  bool is_finite() const { return radbake::is_finite(forward_) && radbake::is_finite(right_); }
  /// The rays of one line, y pixels below the top: `samples` in each of its pixels.
  void aim(double y, int samples, Vec3 eye, std::vector<Ray>& rays) const {
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const Vec3 d = direction((static_cast<double>(k) + 0.5) / samples, y);
      for (int c = 0; c < 3; ++c) {
        rays[k].origin[static_cast<std::size_t>(c)] = static_cast<float>(eye[c]);
        rays[k].direction[static_cast<std::size_t>(c)] = static_cast<float>(d[c]);
      }
    }
  }

 private:
  /// x, y: in pixels from the top left corner.
  Vec3 direction(double x, double y) const {
    return normalized(forward_ + right_ * ((x - width_ / 2.0) * tangent_) - up_ * ((y - height_ / 2.0) * tangent_));
  }

  Vec3 forward_, right_, up_;
  int width_, height_;
  double tangent_;
};

/// The nearest surfaces that are seen: rays go on behind the backs of single-sided ones, as engines leave those out.
/// Directions are of unit length; origins move.
void see(const radiosity::Visibility& visibility, const Surfaces& surfaces, std::vector<Ray>& rays,
         std::vector<Hit>& hits) {
  constexpr int kMostBacks = 64;
  visibility.trace(rays, hits);
  std::vector<std::uint8_t> is_hidden(rays.size());
  for (int k = 0; k < kMostBacks; ++k) {
    bool is_any_hidden = false;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const std::uint32_t triangle = hits[i].triangle;
      const std::array<float, 3>& d = rays[i].direction;
      is_hidden[i] = triangle != radiosity::kNoHit && !surfaces.material(triangle).is_double_sided &&
                     dot(surfaces.normals[triangle], Vec3{d[0], d[1], d[2]}) > 0;
      if (!is_hidden[i]) continue;
      is_any_hidden = true;
      const auto beyond = static_cast<float>(static_cast<double>(hits[i].distance) + surfaces.ray_offsets[triangle]);
      for (std::size_t c = 0; c < 3; ++c) rays[i].origin[c] += beyond * d[c];
    }
    if (!is_any_hidden) return;
    visibility.trace_again(rays, is_hidden, hits);
  }
}

/// What a ray sees of the surface that it met.
Vec3 luminance_at(const BakedScene& baked, const Surfaces& surfaces, const Hit& hit) {
  const SurfacePoint p{hit.triangle, static_cast<double>(hit.u), static_cast<double>(hit.v)};
  Vec3 luminance = surfaces.exitance(p) / std::numbers::pi;
  const int map = baked.lightmap_of_mesh[surfaces.meshes[p.triangle]];
  const Mesh& mesh = surfaces.mesh(p.triangle);
  if (map < 0 || mesh.texcoord1.empty()) return luminance;
  const auto& corner = surfaces.vertices(p.triangle);
  const Vec2 uv =
      mesh.texcoord1[corner[0]] * (1 - p.u - p.v) + mesh.texcoord1[corner[1]] * p.u + mesh.texcoord1[corner[2]] * p.v;
  const Vec3 sent_on = surfaces.reflectance(p) + surfaces.diffuse_transmittance(p);
  luminance += scaled_by(sent_on, looked_up(baked.lightmaps[static_cast<std::size_t>(map)], uv)) / std::numbers::pi;
  return luminance;
}

}  // namespace

Result<BakedScene> read_baked_scene(const std::filesystem::path& folder) {
  RADBAKE_ASSIGN_OR_RETURN(const nlohmann::json document, read_json(folder / "lightmaps.json"));
  BakedScene baked;
  for (const nlohmann::json& lightmap : document["lightmaps"]) {
    const std::string file = exr_of(lightmap);
    if (file.empty()) {
      return invalid_argument((folder / "lightmaps.json").string() +
                              ": a lightmap is not kept as EXR; bake with --encoding exr");
    }
    RADBAKE_ASSIGN_OR_RETURN(image::Pixels pixels, image::read_exr(folder / file));
    if (pixels.channels < 3) return invalid_argument((folder / file).string() + " has fewer than three channels");
    baked.lightmaps.push_back(std::move(pixels));
  }
  const auto decode = [](std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
    return image::decode_image(bytes, name, is_srgb);
  };
  const std::filesystem::path scene = folder / text_of(document, "scene", "scene.glb");
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, gltf::read_gltf(scene, decode, {}));
  const std::map<Primitive, int> known = lightmaps_of(document);
  for (const gltf::MeshSource& source : read.sources) {
    const auto found = known.find({source.node, source.primitive});
    const int map = found == known.end() ? -1 : found->second;
    if (map >= static_cast<int>(baked.lightmaps.size())) {
      return invalid_argument(folder.string() + ": mesh " + std::to_string(source.mesh) + " lies in lightmap " +
                              std::to_string(map) + " of " + std::to_string(baked.lightmaps.size()));
    }
    baked.lightmap_of_mesh.push_back(map);
  }
  baked.scene = std::move(read.scene);
  return baked;
}

Camera default_camera(const Scene& scene) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const Mesh& mesh : scene.meshes) {
    for (const Vec3& p : mesh.positions) {
      for (int c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], p[c]);
        high[c] = std::max(high[c], p[c]);
      }
    }
  }
  // A tenth of the way in from a corner, above the floor as a person's eyes are, or amid what is lower than that.
  constexpr double kIn = 0.1, kEyes = 1.6;
  const Vec3 size = high - low;
  Camera camera;
  camera.eye = {low.x + kIn * size.x, low.y + std::min(kEyes, 0.55 * size.y), high.z - kIn * size.z};
  camera.target = {low.x + 0.6 * size.x, low.y + std::min(0.8 * kEyes, 0.4 * size.y), low.z + 0.4 * size.z};
  camera.fov_degrees = 75;
  return camera;
}

Result<Camera> parse_camera(const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (;;) {
    double value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) {
      numbers.clear();
      break;
    }
    numbers.push_back(value);
    if (next == end) {
      at = end;
      break;
    }
    if (*next != ',') break;
    at = next + 1;
  }
  Camera camera;
  if (numbers.size() == 7) camera.fov_degrees = numbers[6];
  const bool is_right =
      at == end && (numbers.size() == 6 || numbers.size() == 7) && camera.fov_degrees > 0 && camera.fov_degrees < 180;
  if (!is_right) {
    return invalid_argument(
        "camera '" + text +
        "' is not EYE_X,EYE_Y,EYE_Z,TARGET_X,TARGET_Y,TARGET_Z or with DEGREES (0 to 180) after it");
  }
  camera.eye = {numbers[0], numbers[1], numbers[2]};
  camera.target = {numbers[3], numbers[4], numbers[5]};
  return camera;
}

Result<image::Pixels> render_view(const BakedScene& baked, const Camera& camera, const ViewOptions& options) {
  const Lens lens(camera, options);
  if (!lens.is_finite()) return invalid_argument("the camera's target is its eye, or lies straight above or below it");
  // A bake's scene may have lost its lights on the way to the file: what is lit is in the lightmaps.
  Scene scene = baked.scene;
  scene.sky = {1, 1, 1};
  RADBAKE_ASSIGN_OR_RETURN(const radiosity::SurveyedScene surveyed, radiosity::survey_scene(scene));
  const Surfaces& surfaces = surveyed.surfaces;
  const radiosity::SurfaceOpacity opacity(surfaces);
  const auto visibility = radiosity::make_embree_visibility(surfaces.corners, {}, &opacity);
  const Vec3 eye = (camera.eye - surfaces.centre) / surfaces.metres_per_unit;

  image::Pixels picture{options.width, options.height, 3, {}};
  picture.values.resize(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height) * 3);
  const int num_channels = surfaces.has_coloured_tint() ? 3 : 1;
  const auto row_size = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.samples);
  const auto row_of = [&](std::size_t y) { return &picture.values[3 * y * static_cast<std::size_t>(options.width)]; };
  radiosity::for_each_range(static_cast<std::size_t>(options.height), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays(row_size);
    std::vector<Hit> hits(row_size);
    const double share = 1.0 / (options.samples * options.samples);
    for (std::size_t y = begin; y < end; ++y) {
      for (int line = 0; line < options.samples; ++line) {
        lens.aim(static_cast<double>(y) + (line + 0.5) / options.samples, options.samples, eye, rays);
        for (int channel = 0; channel < num_channels; ++channel) {
          std::vector<Ray> onward = rays;
          see(visibility->channel(channel), surfaces, onward, hits);
          for (std::size_t k = 0; k < row_size; ++k) {
            const Vec3 l =
                hits[k].triangle == radiosity::kNoHit ? options.background : luminance_at(baked, surfaces, hits[k]);
            float* pixel = &row_of(y)[3 * (k / static_cast<std::size_t>(options.samples))];
            if (num_channels == 3) {
              pixel[channel] += static_cast<float>(share * l[channel]);
              continue;
            }
            for (int c = 0; c < 3; ++c) pixel[c] += static_cast<float>(share * l[c]);
          }
        }
      }
    }
  });
  return picture;
}

std::vector<std::uint8_t> developed(const image::Pixels& luminance, double exposure) {
  if (exposure <= 0) {
    std::vector<float> levels;
    for (std::size_t at = 0; at + 2 < luminance.values.size(); at += 3) {
      const float level =
          0.2126F * luminance.values[at] + 0.7152F * luminance.values[at + 1] + 0.0722F * luminance.values[at + 2];
      if (level > 0) levels.push_back(level);
    }
    if (levels.empty()) return std::vector<std::uint8_t>(luminance.values.size(), 0);
    const auto rank = static_cast<std::ptrdiff_t>(levels.size() * 95 / 100);
    std::nth_element(levels.begin(), levels.begin() + std::min<std::ptrdiff_t>(rank, std::ssize(levels) - 1),
                     levels.end());
    exposure = 1 / static_cast<double>(
                       levels[static_cast<std::size_t>(std::min<std::ptrdiff_t>(rank, std::ssize(levels) - 1))]);
  }
  std::vector<std::uint8_t> rgb;
  rgb.reserve(luminance.values.size());
  for (const float value : luminance.values) {
    const double l = exposure * static_cast<double>(value), mapped = l * (1 + l / 16) / (1 + l);
    rgb.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(image::linear_to_srgb(mapped), 0.0, 1.0))));
  }
  return rgb;
}

}  // namespace radbake::study
