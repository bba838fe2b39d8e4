#include "client/api/status.h"

#include <gmock/gmock.h>
#include <grpcpp/support/status_code_enum.h>
#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"

namespace radbake::api {
namespace {

using testing::HasSubstr;
using testing::Not;

google::rpc::Status status(int code, const std::string& message) {
  google::rpc::Status status;
  status.set_code(code);
  status.set_message(message);
  return status;
}

TEST(StatusInWords, NamesTheMissingBlobs) {
  google::rpc::Status refusal = status(grpc::StatusCode::FAILED_PRECONDITION, "blobs are missing");
  google::rpc::PreconditionFailure failure;
  for (int i = 0; i < 6; ++i) {
    auto* violation = failure.add_violations();
    violation->set_type("MISSING");
    violation->set_subject("blobs/" + std::to_string(i));
  }
  refusal.add_details()->PackFrom(failure);
  const Error error = to_error(refusal);
  EXPECT_EQ(error.code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(error.message,
            "blobs are missing; MISSING blobs/0; MISSING blobs/1; MISSING blobs/2; MISSING blobs/3; and 2 more");
}

TEST(StatusInWords, SaysADetailOnceWhenTheMessageHoldsIt) {
  google::rpc::Status refusal = status(grpc::StatusCode::INVALID_ARGUMENT, "settings.rays: 0 is not positive");
  google::rpc::BadRequest bad_request;
  auto* violation = bad_request.add_field_violations();
  violation->set_field("settings.rays");
  violation->set_description("0 is not positive");
  refusal.add_details()->PackFrom(bad_request);
  EXPECT_EQ(to_error(refusal).message, "settings.rays: 0 is not positive");
}

TEST(StatusInWords, NamesTheQuotaAndItsValue) {
  google::rpc::Status refusal = status(grpc::StatusCode::RESOURCE_EXHAUSTED, "too large");
  google::rpc::QuotaFailure quota;
  auto* violation = quota.add_violations();
  violation->set_subject("max_triangles");
  violation->set_description("60000000 above the limit 50000000");
  refusal.add_details()->PackFrom(quota);
  const Error error = to_error(refusal);
  EXPECT_EQ(error.code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(error.message, "too large; max_triangles: 60000000 above the limit 50000000");
}

TEST(StatusInWords, BlamesAServerWithoutRoomAndNoScene) {
  for (const char* limit : {"min_free_disk_bytes", "max_content_bytes"}) {
    google::rpc::Status refusal = status(grpc::StatusCode::RESOURCE_EXHAUSTED, "no room");
    google::rpc::QuotaFailure quota;
    quota.add_violations()->set_subject(limit);
    refusal.add_details()->PackFrom(quota);
    EXPECT_EQ(to_error(refusal).code, ErrorCode::kFailedPrecondition) << limit;
  }
}

TEST(StatusInWords, TakesAQuotaThatFreesUpForAServerThatIsBusy) {
  google::rpc::Status refusal = status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the queue is full");
  refusal.add_details()->PackFrom(google::rpc::RetryInfo());
  EXPECT_EQ(to_error(refusal).code, ErrorCode::kUnavailable);
}

TEST(StatusInWords, HasWordsForAnEmptyMessage) {
  EXPECT_THAT(to_error(status(grpc::StatusCode::INTERNAL, "")).message, Not(HasSubstr(":")));
  EXPECT_THAT(to_error(status(grpc::StatusCode::INTERNAL, "")).message, HasSubstr("internal"));
}

}  // namespace
}  // namespace radbake::api
