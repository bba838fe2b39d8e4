#include "common/base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace radbake {
namespace {

Result<int> half_of(int x) {
  if (x % 2 != 0) return invalid_argument(std::to_string(x) + " is odd");
  return x / 2;
}

Result<int> quarter_of(int x) {
  RADBAKE_ASSIGN_OR_RETURN(const int half, half_of(x));
  return half_of(half);
}

TEST(Result, CarriesAValueOrAnErrorThroughCalls) {
  EXPECT_EQ(*quarter_of(12), 3);
  EXPECT_EQ(quarter_of(6).error().message, "3 is odd");
  EXPECT_EQ(quarter_of(5).error().code, ErrorCode::kInvalidArgument);
}

TEST(Result, MovesWhatCannotBeCopied) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(7);
  const std::unique_ptr<int> value = std::move(result).value();
  EXPECT_EQ(*value, 7);
}

}  // namespace
}  // namespace radbake
