// What libradbake_image.so shows: its table of functions.
#include "client/image/image_codec.h"
#include "common/base/version.h"

extern "C" __attribute__((visibility("default"))) const radbake::image::ImageCodec* radbake_image_codec() {
  using namespace radbake;
  static const image::ImageCodec codec{kEngineVersion,         &image::decode_image,      &image::read_environment,
                                       &image::write_exr,      &image::write_preview_png, &image::write_hdr,
                                       &image::write_rgbm_png, &image::encode_linear_png, &image::read_exr,
                                       &image::write_png};
  return &codec;
}
