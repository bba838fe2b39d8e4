#include "client/cli/compare.h"

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "client/cli/commands.h"
#include "client/image/difference_picture.h"
#include "client/image/image_codec.h"

namespace radbake::cli {
namespace {

namespace fs = std::filesystem;

/// The error with the name of the file that it is about: compare_maps() knows images only.
Error in_file(const fs::path& file, const Error& error) { return {error.code, file.string() + ": " + error.message}; }

/// A mask from an EXR, or from a PNG or JPEG: true where the first channel is above 0.
Result<std::vector<std::uint8_t>> read_mask(const image::ImageCodec& images, const fs::path& path,
                                            const image::Pixels& reference) {
  image::Pixels mask;
  if (path.extension() == ".exr") {
    RADBAKE_ASSIGN_OR_RETURN(mask, images.read_exr(path));
  } else {
    std::ifstream file(path, std::ios::binary);
    if (!file) return invalid_argument("cannot read " + path.string());
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    RADBAKE_ASSIGN_OR_RETURN(TexturePlane plane, images.decode_image(std::as_bytes(std::span(bytes)), path.string(),
                                                                     false, image::kMaxImageSide));
    mask = {plane.width, plane.height, plane.channels, std::move(plane.values)};
  }
  if (mask.width != reference.width || mask.height != reference.height) {
    return invalid_argument(path.string() + " has " + std::to_string(mask.width) + " x " + std::to_string(mask.height) +
                            " texels and the reference " + std::to_string(reference.width) + " x " +
                            std::to_string(reference.height));
  }
  std::vector<std::uint8_t> is_in(std::size_t(mask.width) * std::size_t(mask.height));
  for (std::size_t t = 0; t < is_in.size(); ++t) is_in[t] = mask.values[t * std::size_t(mask.channels)] > 0;
  return is_in;
}

/// A map of float values. Readers of other formats would bring 8 bits of another meaning.
Result<image::Pixels> read_map(const image::ImageCodec& images, const fs::path& path) {
  if (path.extension() == ".exr" || path.extension() == ".hdr") return images.read_exr(path);
  return invalid_argument("cannot compare " + path.string() + ": it is neither .exr nor .hdr");
}

Result<std::optional<image::Pixels>> read_if_given(const image::ImageCodec& images, const fs::path& path) {
  if (path.empty()) return std::optional<image::Pixels>();
  RADBAKE_ASSIGN_OR_RETURN(image::Pixels pixels, read_map(images, path));
  return std::optional<image::Pixels>(std::move(pixels));
}

Result<Comparison> compare(const CompareChoices& choices) {
  RADBAKE_ASSIGN_OR_RETURN(const image::ImageCodec* images, image::load_image_codec());
  RADBAKE_ASSIGN_OR_RETURN(const image::Pixels reference, read_map(*images, choices.reference));
  RADBAKE_ASSIGN_OR_RETURN(const image::Pixels map, read_map(*images, choices.map));
  RADBAKE_ASSIGN_OR_RETURN(const auto error, read_if_given(*images, choices.error));
  RADBAKE_ASSIGN_OR_RETURN(const auto reference_error, read_if_given(*images, choices.reference_error));

  std::vector<std::uint8_t> mask = image::comparable_texels(reference, choices.with_edges);
  if (!choices.mask.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(const auto given, read_mask(*images, choices.mask, reference));
    for (std::size_t t = 0; t < mask.size(); ++t) mask[t] = mask[t] && given[t];
  }
  const image::MapPair pair{reference, map, choices.scale};
  const auto difference = image::compare_maps(pair, mask);
  if (!difference.ok()) return in_file(choices.map, difference.error());
  Comparison comparison{*difference, std::nullopt, {}, 0};
  if (error) {
    const auto calibration = image::calibrate(pair, *error, reference_error ? &*reference_error : nullptr, mask);
    if (!calibration.ok()) return in_file(choices.error, calibration.error());
    comparison.calibration = *calibration;
  }
  if (!choices.picture.empty()) {
    const image::DifferencePicture drawn = image::draw_difference(pair, mask);
    RADBAKE_RETURN_IF_ERROR(
        images->write_png(choices.picture, drawn.picture.width, drawn.picture.height, drawn.picture.rgb));
    comparison.picture = choices.picture.string();
    comparison.picture_limit = drawn.limit;
  }
  return comparison;
}

}  // namespace

ExitCode run_compare(const CommandContext& context) {
  const auto comparison = compare(context.line.compare);
  if (!comparison.ok()) return fail(context, comparison.error());
  context.reporter.answer(comparison_text(*comparison), comparison_json(*comparison));
  return kDone;
}

}  // namespace radbake::cli
