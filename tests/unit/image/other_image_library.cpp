// An image library of another version, as a half upgrade leaves it.
#include "client/image/image_codec.h"

extern "C" const radbake::image::ImageCodec* radbake_image_codec() {
  static const radbake::image::ImageCodec codec = [] {
    radbake::image::ImageCodec other{};
    other.engine_version = "0.0.0-other";
    return other;
  }();
  return &codec;
}
