#include "server/study/study_scene.h"

#include <span>
#include <string>
#include <utility>

#include "client/gltf/read_gltf.h"
#include "client/image/decode_image.h"
#include "client/image/read_environment.h"
#include "client/options/scene_light.h"

namespace radbake::study {

Result<StudyScene> read_study_scene(const std::filesystem::path& path, const options::BakeChoices& choices) {
  gltf::ReadOptions reading;
  reading.max_reflectance = choices.max_reflectance;
  const auto decode = [](std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
    return image::decode_image(bytes, name, is_srgb);
  };
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, gltf::read_gltf(path, decode, reading));
  const auto read_environment = [](const std::filesystem::path& file, double scale) {
    return image::read_environment(file, scale);
  };
  RADBAKE_RETURN_IF_ERROR(options::add_sky_and_sun(choices, read_environment, read.scene));
  RADBAKE_RETURN_IF_ERROR(options::require_light(read.scene, path.filename().string()));
  return StudyScene{std::move(read.scene), std::move(read.warnings)};
}

}  // namespace radbake::study
