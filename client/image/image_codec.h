#pragma once

#include <filesystem>

#include "client/image/decode_image.h"
#include "client/image/read_environment.h"
#include "client/image/write_image.h"
#include "common/base/result.h"

namespace radbake::image {

/// The functions of client/image in a library of its own, libradbake_image.so, for programs that seldom need them:
/// it is loaded at the first call, and OpenImageIO with it, which costs more than all else that such a program does.
struct ImageCodec {
  const char* engine_version;  ///< C++ types cross the border: program and library must be of one version
  decltype(&image::decode_image) decode_image;
  decltype(&image::read_environment) read_environment;
  decltype(&image::write_exr) write_exr;
  decltype(&image::write_preview_png) write_preview_png;
  decltype(&image::write_hdr) write_hdr;
  decltype(&image::write_rgbm_png) write_rgbm_png;
  decltype(&image::encode_linear_png) encode_linear_png;
  decltype(&image::read_exr) read_exr;
  decltype(&image::write_png) write_png;
};

/// The one symbol of the library: a function that returns its table, which lives as long as the process.
using ImageCodecSymbol = const ImageCodec*();
inline constexpr char kImageCodecSymbol[] = "radbake_image_codec";

/// The functions of libradbake_image.so, which lies beside the running program or in ../lib.
///
/// The first call loads it; calls at the same time wait for that one. It stays loaded.
/// Errors: kInternal with the file's name: not there, cannot be loaded, another version. Later calls return the same.
Result<const ImageCodec*> load_image_codec();

/// The same for a library that is named, loaded anew.
Result<const ImageCodec*> load_image_codec(const std::filesystem::path& library);

}  // namespace radbake::image
