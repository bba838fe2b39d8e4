#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/image/write_image.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::study {

/// What `radbake submit` wrote: a scene with its lightmaps.
struct BakedScene {
  Scene scene;
  std::vector<image::Pixels> lightmaps;  ///< lx
  std::vector<int> lightmap_of_mesh;     ///< [meshes], into lightmaps; -1: it has none
};

/// Reads scene.glb and the lightmaps that lightmaps.json tells of. Errors: kInvalidArgument, naming the file: it is
/// missing or not what radbake writes, or a lightmap is not kept as EXR.
Result<BakedScene> read_baked_scene(const std::filesystem::path& folder);

/// Where one looks from. Metres, in the scene's axes.
struct Camera {
  Vec3 eye, target;
  Vec3 up{0, 1, 0};
  double fov_degrees = 60;  ///< across the picture's longer side
};

/// From a corner of the scene, at the height of eyes, across it.
Camera default_camera(const Scene& scene);

/// "x,y,z,x,y,z" or with a field of view at its end: eye, target, degrees. Errors: kInvalidArgument with the text.
Result<Camera> parse_camera(const std::string& text);

struct ViewOptions {
  int width = 960, height = 640;
  int samples = 3;    ///< along either side of a pixel
  Vec3 background{};  ///< luminance where nothing is met, nit
};

/// Luminance that arrives at the camera, nit: what surfaces send of their lightmap's light, looked up bilinearly, and
/// what they emit.
///
///   L = (rho + tau) E / pi + L_e
///
/// Rays pass holes and sheets as a bake's do; a sheet's colour is seen by a ray for each channel. Backs of single-sided
/// surfaces are not seen, so that one may look into a room from outside.
/// Shapes: values [height * width * 3]. Errors: kInvalidArgument: the camera looks nowhere.
Result<image::Pixels> render_view(const BakedScene& baked, const Camera& camera, const ViewOptions& options);

/// Luminances as a picture: L' = L (1 + L / 16) / (1 + L) of L times the exposure, in sRGB. Exposure 0: the 95th
/// percentile of the luminances becomes 1.
/// Shapes: rgb [height * width * 3]. Source: Reinhard et al. 2002, eq. 4, with L_white = 4.
std::vector<std::uint8_t> developed(const image::Pixels& luminance, double exposure);

}  // namespace radbake::study
