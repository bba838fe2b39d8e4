// What libradbake_image.so shows: its table of functions.
#include "client/image/image_codec.h"
#include "common/base/version.h"

extern "C" __attribute__((visibility("default"))) const radbake::image::ImageCodec* radbake_image_codec() {
  static const radbake::image::ImageCodec codec{radbake::kEngineVersion, &radbake::image::decode_image,
                                                &radbake::image::write_exr, &radbake::image::write_preview_png};
  return &codec;
}
