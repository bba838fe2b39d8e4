#include "common/base/archive.h"

#include <gtest/gtest.h>

namespace radbake {
namespace {

/// Has one of everything that can be kept.
struct State {
  int number = 0;
  std::string text;
  std::vector<double> values;
  std::vector<float> sized = std::vector<float>(3);

  template <typename Archive>
  void keep(Archive& archive) {
    archive(number);
    archive(text);
    archive(values);
    archive.of_known_size(sized);
  }
};

std::string kept() {
  State state{7, "two words", {1.5, -2.5}, {1, 2, 3}};
  ArchiveWriter writer;
  state.keep(writer);
  return writer.take();
}

TEST(Archive, GivesBackWhatWasKept) {
  const std::string bytes = kept();
  ArchiveReader reader(bytes);
  State state;
  state.keep(reader);
  EXPECT_TRUE(reader.is_at_end());
  EXPECT_EQ(state.number, 7);
  EXPECT_EQ(state.text, "two words");
  EXPECT_EQ(state.values, (std::vector<double>{1.5, -2.5}));
  EXPECT_EQ(state.sized, (std::vector<float>{1, 2, 3}));
}

TEST(Archive, TellsHowManyBytesItWillMake) {
  State state{7, "two words", {1.5, -2.5}, {1, 2, 3}};
  ArchiveSize size;
  state.keep(size);
  EXPECT_EQ(size.bytes(), kept().size());
}

TEST(Archive, FailsAtEveryMissingByte) {
  const std::string bytes = kept();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ArchiveReader reader(std::string_view(bytes).substr(0, size));
    State state;
    state.keep(reader);
    EXPECT_FALSE(reader.is_at_end()) << size;
  }
  const std::string more = bytes + "x";
  ArchiveReader longer(more);
  State state;
  state.keep(longer);
  EXPECT_TRUE(longer.is_good());
  EXPECT_FALSE(longer.is_at_end());
}

TEST(Archive, BelievesNoLengthBeyondItsBytes) {
  ArchiveWriter writer;
  writer(std::uint64_t{1} << 61);
  const std::string bytes = writer.take();
  std::vector<double> values;
  ArchiveReader vector_reader(bytes);
  vector_reader(values);
  EXPECT_FALSE(vector_reader.is_good());
  std::string text;
  ArchiveReader text_reader(bytes);
  text_reader(text);
  EXPECT_FALSE(text_reader.is_good());
  EXPECT_FALSE(ArchiveReader(bytes).can_hold(std::uint64_t{1} << 61, 16));
}

TEST(Archive, RefusesAnotherNumberThanIsKnown) {
  ArchiveWriter writer;
  writer(std::vector<float>{1, 2, 3});
  const std::string bytes = writer.take();
  std::vector<float> four(4, 9);
  ArchiveReader reader(bytes);
  reader.of_known_size(four);
  EXPECT_FALSE(reader.is_good());
  EXPECT_EQ(four, std::vector<float>(4, 9));
}

}  // namespace
}  // namespace radbake
