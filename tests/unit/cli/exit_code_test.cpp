#include "client/cli/exit_code.h"

#include <gmock/gmock.h>
#include <grpcpp/support/status_code_enum.h>
#include <gtest/gtest.h>

namespace radbake::cli {
namespace {

using testing::HasSubstr;

v1::Bake ended(v1::BakeState state, int status_code = 0, const std::string& message = "") {
  v1::Bake bake;
  bake.set_name("bakes/1");
  bake.set_state(state);
  if (state == v1::FAILED) {
    bake.mutable_error()->set_code(status_code);
    bake.mutable_error()->set_message(message);
  }
  return bake;
}

TEST(ExitCodes, SayHowABakeEnded) {
  EXPECT_EQ(exit_code_of(ended(v1::SUCCEEDED)), 0);
  EXPECT_EQ(exit_code_of(ended(v1::CANCELLED)), 6);
  EXPECT_EQ(exit_code_of(ended(v1::FAILED, grpc::StatusCode::INTERNAL)), 5);
  EXPECT_EQ(exit_code_of(ended(v1::FAILED, grpc::StatusCode::UNAVAILABLE)), 5);
}

TEST(ExitCodes, TellABadSceneThatOnlyTheWorkerFound) {
  EXPECT_EQ(exit_code_of(ended(v1::FAILED, grpc::StatusCode::INVALID_ARGUMENT)), 3);
  EXPECT_EQ(exit_code_of(ended(v1::FAILED, grpc::StatusCode::RESOURCE_EXHAUSTED)), 3);
  EXPECT_EQ(exit_code_of(ended(v1::FAILED, grpc::StatusCode::DATA_LOSS)), 3);
}

TEST(ExitCodes, SayWhyACallFailed) {
  EXPECT_EQ(exit_code_of(ErrorCode::kInvalidArgument), 3);
  EXPECT_EQ(exit_code_of(ErrorCode::kDataLoss), 3);
  EXPECT_EQ(exit_code_of(ErrorCode::kUnavailable), 4);
  EXPECT_EQ(exit_code_of(ErrorCode::kFailedPrecondition), 4);
  EXPECT_EQ(exit_code_of(ErrorCode::kNotFound), 2);
  EXPECT_EQ(exit_code_of(ErrorCode::kCancelled), 6);
  EXPECT_EQ(exit_code_of(ErrorCode::kInternal), 5);
}

TEST(ExitCodes, ComeWithTheReasonOfTheBake) {
  EXPECT_EQ(error_of(ended(v1::FAILED, grpc::StatusCode::INTERNAL, "worker died")).message,
            "bakes/1 failed: worker died");
  EXPECT_THAT(error_of(ended(v1::CANCELLED)).message, HasSubstr("cancelled"));
}

}  // namespace
}  // namespace radbake::cli
