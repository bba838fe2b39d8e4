#include "client/image/write_image.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <regex>
#include <sstream>

namespace radbake::image {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class WriteImage : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "radbake-image-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file(const char* name) const { return folder_ / name; }
  std::string bytes_of(const char* name) const {
    std::ostringstream text;
    text << std::ifstream(file(name), std::ios::binary).rdbuf();
    return text.str();
  }
  std::vector<std::uint8_t> png_pixels(const char* name, int channels) const {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);  // else colours come multiplied by A
    const auto input = OIIO::ImageInput::open(file(name).string(), &config);
    EXPECT_EQ(input->spec().nchannels, channels);
    std::vector<std::uint8_t> pixels(std::size_t(input->spec().width) * std::size_t(input->spec().height) *
                                     std::size_t(channels));
    EXPECT_TRUE(input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, pixels.data()));
    return pixels;
  }

  std::filesystem::path folder_;
};

std::vector<float> ramp(int width, int height) {
  std::vector<float> values;
  for (int i = 0; i < width * height; ++i) {
    const float v = static_cast<float>(i);
    values.insert(values.end(), {v, v / 3, v * 1000, i % 2 ? 1.0f : 0.0f});
  }
  return values;
}

TEST_F(WriteImage, ExrGivesBackEveryBit) {
  std::vector<float> values = ramp(5, 3);
  values[0] = 1e-30f;
  values[1] = 3e38f;
  ASSERT_TRUE(write_exr(file("map.exr"), 5, 3, 4, values).ok());
  const auto read = read_exr(file("map.exr"));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->width, 5);
  EXPECT_EQ(read->height, 3);
  EXPECT_EQ(read->channels, 4);
  EXPECT_EQ(read->values, values);
}

TEST_F(WriteImage, ExrSaysWhatItsNumbersAre) {
  ASSERT_TRUE(write_exr(file("map.exr"), 5, 3, 4, ramp(5, 3)).ok());
  const auto input = OIIO::ImageInput::open(file("map.exr").string());
  const OIIO::ImageSpec& spec = input->spec();
  EXPECT_EQ(spec.format, OIIO::TypeDesc::FLOAT);
  EXPECT_EQ(spec.channelnames, (std::vector<std::string>{"R", "G", "B", "A"}));
  EXPECT_EQ(spec.get_string_attribute("compression"), "zip");
  EXPECT_EQ(spec.get_string_attribute("unit"), "lx");
  const OIIO::ParamValue* chromaticities = spec.find_attribute("chromaticities");
  ASSERT_NE(chromaticities, nullptr);
  EXPECT_EQ(static_cast<const float*>(chromaticities->data())[0], 0.64f);
  EXPECT_EQ(static_cast<const float*>(chromaticities->data())[7], 0.329f);
  // Openness is a share.
  ASSERT_TRUE(write_exr(file("ao.exr"), 5, 3, 4, ramp(5, 3), "1").ok());
  EXPECT_EQ(OIIO::ImageInput::open(file("ao.exr").string())->spec().get_string_attribute("unit"), "1");
}

TEST_F(WriteImage, EqualImagesHaveEqualBytesAndNoDate) {
  for (const char* name : {"a.exr", "b.exr"}) ASSERT_TRUE(write_exr(file(name), 5, 3, 4, ramp(5, 3)).ok());
  for (const char* name : {"a.png", "b.png"}) ASSERT_TRUE(write_preview_png(file(name), 5, 3, 4, ramp(5, 3)).ok());
  EXPECT_EQ(bytes_of("a.exr"), bytes_of("b.exr"));
  EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png"));
  // OpenImageIO writes the time into an EXR unless told otherwise, as 2026:01:31 23:59:59.
  EXPECT_FALSE(std::regex_search(bytes_of("a.exr"), std::regex("[0-9]{4}:[0-9]{2}:[0-9]{2} ")));
  EXPECT_THAT(bytes_of("a.png"), Not(HasSubstr("tIME")));
}

TEST_F(WriteImage, LeavesNothingBesideTheFile) {
  ASSERT_TRUE(write_exr(file("map.exr"), 5, 3, 4, ramp(5, 3)).ok());
  ASSERT_TRUE(write_exr(file("map.exr"), 5, 3, 4, ramp(5, 3)).ok());  // replaces
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) names.push_back(entry.path().filename());
  EXPECT_THAT(names, ::testing::ElementsAre("map.exr"));
}

TEST_F(WriteImage, NamesTheFileThatCannotBeWritten) {
  const auto result = write_exr(file("missing") / "map.exr", 5, 3, 4, ramp(5, 3));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kInternal);
  EXPECT_THAT(result.error().message, HasSubstr("missing/map.exr"));
  EXPECT_FALSE(write_exr(file("map.exr"), 5, 4, 4, ramp(5, 3)).ok());
  EXPECT_FALSE(read_exr(file("map.exr")).ok());
}

TEST_F(WriteImage, PreviewExposesByTheCoveredTexels) {
  // 20 covered texels of 100 lx and 20 that are not covered and very bright.
  std::vector<float> values;
  for (int i = 0; i < 40; ++i) {
    const bool is_covered = i < 20;
    for (int c = 0; c < 3; ++c) values.push_back(is_covered ? 100 : 1e6f);
    values.push_back(is_covered ? 1 : 0);
  }
  ASSERT_TRUE(write_preview_png(file("map.png"), 40, 1, 4, values).ok());
  const std::vector<std::uint8_t> pixels = png_pixels("map.png", 3);
  // L = 1: L' = (1 + 1/16) / 2 = 0.53125, by sRGB's curve 0.75491, of 255: 192.5.
  EXPECT_NEAR(pixels.at(0), 192.5, 0.5);
  EXPECT_EQ(pixels.at(3 * 30), 255);
}

TEST_F(WriteImage, PreviewDoesNotDependOnTheUnit) {
  std::vector<float> values = ramp(5, 3);
  ASSERT_TRUE(write_preview_png(file("lx.png"), 5, 3, 4, values).ok());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] *= i % 4 == 3 ? 1.0f : 1024.0f;
  ASSERT_TRUE(write_preview_png(file("more.png"), 5, 3, 4, values).ok());
  EXPECT_EQ(bytes_of("lx.png"), bytes_of("more.png"));
}

TEST_F(WriteImage, PreviewShowsDarknessAndNonsenseAsBlack) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(write_preview_png(file("dark.png"), 2, 1, 4, std::vector<float>{0, 0, 0, 1, nan, nan, nan, 1}).ok());
  EXPECT_EQ(png_pixels("dark.png", 3), std::vector<std::uint8_t>(6, 0));
}

TEST_F(WriteImage, HdrKeepsEachTexelWithinTheStepOfItsSharedExponent) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> values = {1, 0.5f, 0.25f, 1, 12345, 1, 0, 0, 1e-3f, 2e-3f, 3e-3f, 1, nan, -4, 7, 1};
  ASSERT_TRUE(write_hdr(file("map.hdr"), 4, 1, 4, values).ok());
  EXPECT_THAT(bytes_of("map.hdr"), ::testing::StartsWith("#?RADIANCE"));
  const auto read = read_exr(file("map.hdr"));  // any format that OpenImageIO reads
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->channels, 3);
  // 8 bits of mantissa for the brightest channel, which lies in the upper half of their range.
  constexpr float kStep = 1.0f / 128;
  const std::vector<float> expected = {1, 0.5f, 0.25f, 12345, 1, 0, 1e-3f, 2e-3f, 3e-3f, 0, 0, 7};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::size_t texel = i / 3 * 3;
    const float brightest = std::max({expected[texel], expected[texel + 1], expected[texel + 2]});
    EXPECT_NEAR(read->values[i], expected[i], kStep * brightest) << i;
  }
}

TEST_F(WriteImage, RgbmGivesBackTheLightWithinItsStep) {
  constexpr double kMultiplier = 400;
  const std::vector<float> values = {400, 200, 100, 0, 0, 0, 1, 2, 3, 500, -1, 40};
  ASSERT_TRUE(write_rgbm_png(file("map.png"), 4, 1, 3, values, kMultiplier).ok());
  const std::vector<std::uint8_t> pixels = png_pixels("map.png", 4);
  const std::vector<double> expected = {400, 200, 100, 0, 0, 0, 1, 2, 3, 400, 0, 40};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double m = pixels[i / 3 * 4 + 3] / 255.0;
    const double shown = pixels[i / 3 * 4 + i % 3] / 255.0 * m * kMultiplier;
    EXPECT_NEAR(shown, expected[i], 0.5 / 255 * m * kMultiplier * (1 + 1e-12)) << i;  // half a step of 8 bits
  }
  // A black texel keeps an M, and colours are stored as they are, not divided by it.
  EXPECT_EQ(pixels[7], 1);
  EXPECT_EQ(pixels[0], 255);
  EXPECT_EQ(pixels[3], 255);
}

TEST_F(WriteImage, LinearPngHoldsSharesOfTheIntensityIn16Bits) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> values = {100, 50, 25, 1, 0, nan, 1e9f, 1, -5, 0.1f, 0.001f, 1};
  const auto png = encode_linear_png(3, 1, 4, values, 100);
  ASSERT_TRUE(png.ok()) << png.error().message;
  std::ofstream(file("map.png"), std::ios::binary) << *png;
  const auto input = OIIO::ImageInput::open(file("map.png").string());
  ASSERT_EQ(input->spec().format, OIIO::TypeDesc::UINT16);
  std::vector<std::uint16_t> pixels(9);
  ASSERT_TRUE(input->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT16, pixels.data()));
  EXPECT_THAT(pixels, ::testing::ElementsAre(65535, 32768, 16384, 0, 0, 65535, 0, 66, 1));
  // No chunk that makes a browser change the numbers, and no date.
  for (const char* chunk : {"gAMA", "sRGB", "iCCP", "cHRM", "tIME"}) EXPECT_THAT(*png, Not(HasSubstr(chunk)));
  EXPECT_EQ(*encode_linear_png(3, 1, 4, values, 100), *png);
}

TEST_F(WriteImage, EveryWriterRefusesValuesOfAnotherShape) {
  const std::vector<float> values(12);
  EXPECT_FALSE(write_hdr(file("map.hdr"), 3, 2, 4, values).ok());
  EXPECT_FALSE(write_rgbm_png(file("map.png"), 3, 1, 2, values, 1).ok());
  EXPECT_FALSE(encode_linear_png(3, 1, 2, values, 1).ok());
}

}  // namespace
}  // namespace radbake::image
