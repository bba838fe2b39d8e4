#include "client/image/read_environment.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <vector>

#include "client/image/decode_image.h"

namespace radbake::image {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Sums in double, kept as float.
constexpr double kFloat = 1e-6;
// A shared exponent leaves 8 bits of the brightest channel.
constexpr double kRgbe = 1.0 / 128;

class ReadEnvironment : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "radbake-sky-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path written(const std::string& name, int width, int height, int channels, const std::vector<float>& pixels,
                   int tile = 0) {
    OIIO::ImageSpec spec(width, height, channels, OIIO::TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = tile;
    return written(name, spec, pixels);
  }
  fs::path written(const std::string& name, const OIIO::ImageSpec& spec, const std::vector<float>& pixels) {
    const auto output = OIIO::ImageOutput::create(name);
    EXPECT_TRUE(output->open((folder_ / name).string(), spec)) << output->geterror();
    EXPECT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data())) << output->geterror();
    output->close();
    return folder_ / name;
  }

  static TexturePlane read(const fs::path& path, double scale = 1, int max_width = kMaxEnvironmentWidth) {
    Result<TexturePlane> plane = read_environment(path, scale, max_width);
    EXPECT_TRUE(plane.ok()) << plane.error().message;
    return plane.ok() ? std::move(plane).value() : TexturePlane{};
  }
  static std::string problem_of(const fs::path& path, double scale = 1) {
    const Result<TexturePlane> plane = read_environment(path, scale);
    return plane.ok() ? "read" : plane.error().message;
  }

  fs::path folder_;
};

TEST_F(ReadEnvironment, TakesTheValuesOfAnExrTimesTheScale) {
  const TexturePlane sky = read(written("dawn.exr", 2, 1, 3, {0, 0.1F, 1e-3F, 7, 5e4F, 1}), 3);
  EXPECT_EQ(sky.name, "dawn.exr");
  EXPECT_EQ(sky.width, 2);
  EXPECT_EQ(sky.height, 1);
  EXPECT_EQ(sky.channels, 3);
  EXPECT_THAT(sky.values,
              ElementsAre(0, static_cast<float>(0.1F * 3.0), static_cast<float>(1e-3F * 3.0), 21, 15e4F, 3));
}

TEST_F(ReadEnvironment, ReadsRadianceHdr) {
  const TexturePlane sky = read(written("dawn.hdr", 4, 2, 3, std::vector<float>(24, 0.75F)));
  ASSERT_EQ(sky.values.size(), 24U);
  for (const float value : sky.values) EXPECT_NEAR(value, 0.75, 0.75 * kRgbe);
}

TEST_F(ReadEnvironment, StartsWithTheRowOfTheZenith) {
  std::vector<float> pixels(4 * 2 * 3, 1.0F);
  pixels[0] = 9;
  const TexturePlane sky = read(written("dawn.hdr", 4, 2, 3, pixels));
  EXPECT_NEAR(sky.values[0], 9, 9 * kRgbe);
  EXPECT_NEAR(sky.values[12], 1, kRgbe);
}

TEST_F(ReadEnvironment, TakesOneChannelAsGreyAndLeavesOpacityOut) {
  EXPECT_THAT(read(written("grey.exr", 2, 1, 1, {0.25F, 4})).values, ElementsAre(0.25F, 0.25F, 0.25F, 4, 4, 4));
  EXPECT_THAT(read(written("rgba.exr", 2, 1, 4, {1, 2, 3, 0.5F, 4, 5, 6, 0.5F})).values, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(ReadEnvironment, ReadsTiles) {
  std::vector<float> pixels;
  for (int i = 0; i < 64 * 32 * 3; ++i) pixels.push_back(static_cast<float>(i));
  EXPECT_EQ(read(written("tiles.exr", 64, 32, 3, pixels, 16)).values, pixels);
}

TEST_F(ReadEnvironment, KeepsAConstantSkyWhenItReduces) {
  for (const int width : {8, 6}) {  // 12 pixels to 8 do not divide
    const TexturePlane sky = read(written("even.exr", 12, 6, 3, std::vector<float>(12 * 6 * 3, 2.5F)), 1, width);
    EXPECT_EQ(sky.width, width);
    EXPECT_EQ(sky.height, width / 2);
    for (const float value : sky.values) EXPECT_NEAR(value, 2.5, 2.5 * kFloat);
  }
}

TEST_F(ReadEnvironment, KeepsTheLightOfASunOfOnePixelWhenItReduces) {
  // The sum of luminance x solid angle; a plain mean would be off by the share of cosines in a pair of rows.
  constexpr int kWidth = 32, kHeight = 16;
  const auto light_of = [](const std::vector<float>& values, int width, int height) {
    double sum = 0;
    for (int y = 0; y < height; ++y) {
      const double theta = std::numbers::pi * y / height;
      const double row = std::cos(theta) - std::cos(theta + std::numbers::pi / height);
      for (int x = 0; x < width; ++x) sum += values[3 * (y * width + x)] * row * 2 * std::numbers::pi / width;
    }
    return sum;
  };
  for (const int row : {0, 1, 5, 15}) {
    std::vector<float> pixels(kWidth * kHeight * 3, 0.125F);
    for (int c = 0; c < 3; ++c) pixels[3 * (row * kWidth + 21) + c] = 1e5F;
    const fs::path file = written("sun.exr", kWidth, kHeight, 3, pixels);
    const double before = light_of(pixels, kWidth, kHeight);
    EXPECT_NEAR(light_of(read(file, 1, 16).values, 16, 8) / before, 1, kFloat) << row;
  }
}

TEST_F(ReadEnvironment, NamesTheFileThatIsMissingOrOfAnotherKind) {
  EXPECT_EQ(problem_of(folder_ / "nowhere.hdr"), (folder_ / "nowhere.hdr").string() + ": there is no such file");
  EXPECT_THAT(problem_of(folder_), HasSubstr("it is a folder"));
  std::ofstream(folder_ / "text.hdr") << "no picture";
  EXPECT_THAT(problem_of(folder_ / "text.hdr"), HasSubstr("text.hdr: neither a Radiance .hdr nor an OpenEXR image"));
  std::ofstream(folder_ / "empty.exr");
  EXPECT_THAT(problem_of(folder_ / "empty.exr"), HasSubstr("neither a Radiance .hdr nor an OpenEXR image"));
  EXPECT_THAT(problem_of(written("small.png", 2, 1, 3, std::vector<float>(6, 0.5F))), HasSubstr("neither"));
}

TEST_F(ReadEnvironment, RefusesWhatIsNotTwiceAsWideAsHigh) {
  EXPECT_THAT(problem_of(written("square.exr", 4, 4, 3, std::vector<float>(48, 1.0F))),
              AllOf(HasSubstr("square.exr: it is 4 x 4 pixels"), HasSubstr("twice as wide as high")));
}

TEST_F(ReadEnvironment, RefusesACroppedImage) {
  OIIO::ImageSpec spec(4, 2, 3, OIIO::TypeDesc::FLOAT);
  spec.full_width = 8;
  spec.full_height = 4;
  EXPECT_THAT(problem_of(written("cut.exr", spec, std::vector<float>(24, 1.0F))),
              HasSubstr("cut.exr: it is cropped: 4 x 2 pixels of 8 x 4"));
}

TEST_F(ReadEnvironment, NamesThePixelThatIsNoLight) {
  const auto bad = [&](float value, double scale = 1) {
    std::vector<float> pixels(4 * 2 * 3, 1.0F);
    pixels[(1 * 4 + 2) * 3 + 1] = value;
    return problem_of(written("bad.exr", 4, 2, 3, pixels), scale);
  };
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_THAT(bad(std::nanf("")), HasSubstr("bad.exr: it has the value nan at pixel (2, 1)"));
  EXPECT_THAT(bad(infinity), HasSubstr("it has the value inf at pixel (2, 1)"));
  EXPECT_THAT(bad(-0.5F), HasSubstr("it has the value -0.5 at pixel (2, 1)"));
  EXPECT_THAT(bad(1e30F, 1000), HasSubstr("it has the value 1e+30 at pixel (2, 1), to be scaled by 1000"));
}

TEST_F(ReadEnvironment, RefusesATruncatedFile) {
  for (const char* name : {"whole.exr", "whole.hdr"}) {
    std::vector<float> pixels;
    for (int i = 0; i < 64 * 32 * 3; ++i) pixels.push_back(static_cast<float>((i * 7919) % 1000));
    const fs::path file = written(name, 64, 32, 3, pixels);
    fs::resize_file(file, fs::file_size(file) / 2);
    EXPECT_THAT(problem_of(file), AllOf(HasSubstr(name), HasSubstr("cannot be read"))) << name;
  }
}

}  // namespace
}  // namespace radbake::image
