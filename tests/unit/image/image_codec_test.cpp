#include "client/image/image_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>
#include <vector>

// OpenImageIO keeps what it allocates when it is loaded.
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the leak sanitizer looks for this name
extern "C" const char* __lsan_default_suppressions() { return "leak:OpenImageIO"; }

namespace radbake::image {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ImageCodecTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "radbake-codec-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string text_of(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  fs::path folder_;
};

TEST_F(ImageCodecTest, LoadsOpenImageIoWhenItIsAskedAndNotBefore) {
  EXPECT_THAT(text_of("/proc/self/maps"), AllOf(HasSubstr("libc.so"), Not(HasSubstr("libOpenImageIO"))));
  // Found from this program's folder, by several threads at once.
  std::vector<const ImageCodec*> found(4);
  {
    std::vector<std::jthread> threads;
    for (const ImageCodec*& codec : found) threads.emplace_back([&] { codec = load_image_codec().value(); });
  }
  EXPECT_THAT(found, ::testing::Each(found[0]));
  EXPECT_THAT(text_of("/proc/self/maps"), HasSubstr("libOpenImageIO"));
}

TEST_F(ImageCodecTest, WritesAndReadsThroughTheLibrary) {
  const auto codec = load_image_codec(RADBAKE_IMAGE_LIBRARY);
  ASSERT_TRUE(codec.ok()) << codec.error().message;
  const std::vector<float> grey(4 * 2 * 3, 1.0f);
  ASSERT_TRUE((*codec)->write_exr(folder_ / "map.exr", 4, 2, 3, grey, "lx").ok());
  EXPECT_THAT(text_of(folder_ / "map.exr"), ::testing::StartsWith("\x76\x2f\x31\x01"));  // OpenEXR's magic number
  ASSERT_TRUE((*codec)->write_preview_png(folder_ / "map.png", 4, 2, 3, grey).ok());
  const std::string png = text_of(folder_ / "map.png");
  const auto plane = (*codec)->decode_image(std::as_bytes(std::span(png)), "map", true, kDefaultMaxSide);
  ASSERT_TRUE(plane.ok()) << plane.error().message;
  EXPECT_EQ(plane->width, 4);
  EXPECT_EQ(plane->height, 2);
  const auto sky = (*codec)->read_environment(folder_ / "map.exr", 2, kMaxEnvironmentWidth);
  ASSERT_TRUE(sky.ok()) << sky.error().message;
  EXPECT_EQ(sky->values, std::vector<float>(24, 2.0f));
  // Errors cross the border too.
  const auto refused = (*codec)->write_exr(folder_ / "none" / "map.exr", 4, 2, 3, grey, "lx");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("none/map.exr: No such file"));
}

TEST_F(ImageCodecTest, NamesALibraryThatIsMissingOrNone) {
  const auto missing = load_image_codec(folder_ / "missing.so");
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr((folder_ / "missing.so").string()));
  std::ofstream(folder_ / "text.so") << "no library";
  EXPECT_THAT(load_image_codec(folder_ / "text.so").error().message, HasSubstr("text.so"));
}

TEST_F(ImageCodecTest, RefusesALibraryOfAnotherVersion) {
  const auto other = load_image_codec(RADBAKE_OTHER_IMAGE_LIBRARY);
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(other.error().message, AllOf(HasSubstr(RADBAKE_OTHER_IMAGE_LIBRARY), HasSubstr("0.0.0-other")));
}

}  // namespace
}  // namespace radbake::image
