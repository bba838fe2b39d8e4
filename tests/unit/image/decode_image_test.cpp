#include "client/image/decode_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace radbake::image {
namespace {

using ::testing::HasSubstr;

// sRGB values and planes are float.
constexpr double kFloat = 1e-6;

template <typename T>
std::vector<unsigned char> encoded(const char* name, int width, int height, int channels, OIIO::TypeDesc type,
                                   const std::vector<T>& pixels) {
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = OIIO::ImageOutput::create(name, &memory);
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  EXPECT_TRUE(output->open(name, spec)) << output->geterror();
  EXPECT_TRUE(output->write_image(type, pixels.data())) << output->geterror();
  output->close();
  return bytes;
}

std::vector<unsigned char> png(int width, int height, int channels, const std::vector<std::uint8_t>& pixels) {
  return encoded("image.png", width, height, channels, OIIO::TypeDesc::UINT8, pixels);
}

TexturePlane decode(const std::vector<unsigned char>& bytes, bool is_srgb, int max_side = kDefaultMaxSide) {
  Result<TexturePlane> plane = decode_image(std::as_bytes(std::span(bytes)), "test", is_srgb, max_side);
  EXPECT_TRUE(plane.ok()) << plane.error().message;
  return plane.ok() ? std::move(plane).value() : TexturePlane{};
}

TEST(DecodeImage, TakesColoursFromSrgbToLinearLight) {
  const TexturePlane plane = decode(png(2, 1, 3, {0, 128, 255, 10, 64, 200}), true);
  EXPECT_EQ(plane.width, 2);
  EXPECT_EQ(plane.height, 1);
  EXPECT_EQ(plane.channels, 3);
  // IEC 61966-2-1: 128/255 -> 0.2158605, and 10/255 lies on the straight piece.
  EXPECT_EQ(plane.values.at(0), 0);
  EXPECT_NEAR(plane.values.at(1), 0.2158605, kFloat);
  EXPECT_EQ(plane.values.at(2), 1);
  EXPECT_NEAR(plane.values.at(3), 10 / 255.0 / 12.92, kFloat);
}

TEST(DecodeImage, HalfInSrgbIs2140) {
  // 16 bits hold 0.5 within 1/65535.
  const auto bytes =
      encoded("image.png", 1, 1, 3, OIIO::TypeDesc::UINT16, std::vector<std::uint16_t>{32768, 32768, 32768});
  constexpr double kSixteenBits = 2e-5;
  EXPECT_NEAR(decode(bytes, true).values.at(0), 0.21404114, kSixteenBits);
}

TEST(DecodeImage, LeavesOtherValuesAsTheyAre) {
  const TexturePlane plane = decode(png(1, 1, 3, {0, 51, 255}), false);
  EXPECT_NEAR(plane.values.at(1), 0.2, kFloat);
}

TEST(DecodeImage, LeavesOpacityAndColoursUnderItAsTheyAre) {
  const TexturePlane plane = decode(png(2, 1, 4, {255, 255, 255, 51, 255, 255, 255, 0}), true);
  ASSERT_EQ(plane.channels, 4);
  EXPECT_EQ(plane.values.at(0), 1);
  EXPECT_NEAR(plane.values.at(3), 0.2, kFloat);
  EXPECT_EQ(plane.values.at(4), 1);
  EXPECT_EQ(plane.values.at(7), 0);
}

TEST(DecodeImage, ExpandsGreyToColour) {
  const TexturePlane grey = decode(png(1, 1, 1, {255}), true);
  EXPECT_EQ(grey.values, (std::vector<float>{1, 1, 1}));
  const TexturePlane with_opacity = decode(png(1, 1, 2, {255, 0}), true);
  EXPECT_EQ(with_opacity.values, (std::vector<float>{1, 1, 1, 0}));
}

TEST(DecodeImage, ReducesInLinearLight) {
  // Black and white in turn: the mean of light is 0.5, the mean of sRGB would be 0.2140.
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) pixels.insert(pixels.end(), 3, (x + y) % 2 ? 255 : 0);
  }
  const TexturePlane plane = decode(png(16, 8, 3, pixels), true, 4);
  EXPECT_EQ(plane.width, 4);
  EXPECT_EQ(plane.height, 2);
  for (const float value : plane.values) EXPECT_NEAR(value, 0.5, kFloat);
}

TEST(DecodeImage, KeepsRowsFromTheTop) {
  const TexturePlane plane = decode(png(1, 2, 3, {255, 0, 0, 0, 0, 255}), true);
  EXPECT_EQ(plane.values, (std::vector<float>{1, 0, 0, 0, 0, 1}));
}

TEST(DecodeImage, ReadsJpeg) {
  const auto bytes = encoded("image.jpg", 8, 8, 3, OIIO::TypeDesc::UINT8, std::vector<std::uint8_t>(8 * 8 * 3, 128));
  constexpr double kJpegLevel = 0.01;  // about one of 256 levels at this grey, in linear light
  EXPECT_NEAR(decode(bytes, true).values.at(0), 0.2158605, kJpegLevel);
}

std::string refusal(std::vector<unsigned char> bytes) {
  const auto plane = decode_image(std::as_bytes(std::span(bytes)), "test", true);
  EXPECT_FALSE(plane.ok());
  return plane.ok() ? "" : plane.error().message;
}

TEST(DecodeImage, RefusesWhatIsNeitherPngNorJpeg) {
  EXPECT_THAT(refusal({}), HasSubstr("neither a PNG nor a JPEG"));
  EXPECT_THAT(refusal({'G', 'I', 'F', '8', '9', 'a'}), HasSubstr("neither a PNG nor a JPEG"));
}

TEST(DecodeImage, RefusesATruncatedImage) {
  std::vector<std::uint8_t> noise(64 * 64 * 3);
  unsigned state = 1;
  for (std::uint8_t& value : noise) value = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
  auto bytes = png(64, 64, 3, noise);
  bytes.resize(bytes.size() / 2);
  EXPECT_THAT(refusal(bytes), HasSubstr("cannot be decoded"));
  bytes.resize(20);
  EXPECT_THAT(refusal(bytes), HasSubstr("cannot be decoded"));
}

// CRC-32 as PNG uses it.
std::uint32_t crc32(const unsigned char* bytes, std::size_t size) {
  std::uint32_t crc = ~0u;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

TEST(DecodeImage, RefusesAnAbsurdSizeBeforeItTakesMemory) {
  // The header of a small file now claims 500,000 x 500,000 pixels.
  auto bytes = png(1, 1, 3, {1, 2, 3});
  for (const std::size_t at : {std::size_t{16}, std::size_t{20}}) {
    bytes[at] = 0x00, bytes[at + 1] = 0x07, bytes[at + 2] = 0xA1, bytes[at + 3] = 0x20;
  }
  const std::uint32_t crc = crc32(&bytes[12], 17);
  for (std::size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<unsigned char>(crc >> (24 - 8 * i));
  EXPECT_THAT(refusal(bytes), HasSubstr("500000 x 500000"));
}

}  // namespace
}  // namespace radbake::image
