#include "client/api/status.h"

#include <grpcpp/support/status_code_enum.h>

#include <algorithm>
#include <vector>

#include "google/rpc/error_details.pb.h"

namespace radbake::api {
namespace {

/// A message of the server may carry one detail for each of a thousand blobs: people read a few.
constexpr std::size_t kMaxDetailsShown = 4;

ErrorCode to_code(int status_code) {
  switch (status_code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE: return ErrorCode::kInvalidArgument;
    case grpc::StatusCode::NOT_FOUND: return ErrorCode::kNotFound;
    case grpc::StatusCode::ALREADY_EXISTS: return ErrorCode::kAlreadyExists;
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::UNIMPLEMENTED:
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED: return ErrorCode::kFailedPrecondition;
    case grpc::StatusCode::RESOURCE_EXHAUSTED: return ErrorCode::kResourceExhausted;
    case grpc::StatusCode::DATA_LOSS: return ErrorCode::kDataLoss;
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::ABORTED: return ErrorCode::kUnavailable;
    case grpc::StatusCode::CANCELLED: return ErrorCode::kCancelled;
    default: return ErrorCode::kInternal;
  }
}

/// "a: b", or the one that is there.
std::string joined(const std::string& a, const std::string& b) { return a.empty() ? b : b.empty() ? a : a + ": " + b; }

/// Limits on what the server has room for, whatever it is sent. Older servers name them in the description alone.
bool is_lack_of_room(const google::rpc::QuotaFailure& quota) {
  return std::any_of(quota.violations().begin(), quota.violations().end(), [](const auto& violation) {
    const std::string words = joined(violation.subject(), violation.description());
    return words.find("min_free_disk_bytes") != std::string::npos ||
           words.find("max_content_bytes") != std::string::npos;
  });
}

std::vector<std::string> details_in_words(const google::protobuf::Any& detail) {
  std::vector<std::string> words;
  google::rpc::BadRequest bad_request;
  google::rpc::PreconditionFailure precondition;
  google::rpc::QuotaFailure quota;
  if (detail.UnpackTo(&bad_request)) {
    for (const auto& v : bad_request.field_violations()) words.push_back(joined(v.field(), v.description()));
  } else if (detail.UnpackTo(&precondition)) {
    for (const auto& v : precondition.violations()) {
      words.push_back(joined(v.type() + (v.subject().empty() ? "" : " ") + v.subject(), v.description()));
    }
  } else if (detail.UnpackTo(&quota)) {
    for (const auto& v : quota.violations()) words.push_back(joined(v.subject(), v.description()));
  }
  return words;
}

}  // namespace

Error to_error(const google::rpc::Status& status) {
  Error error{to_code(status.code()), status.message()};
  if (error.message.empty()) {
    error.message = std::string("the server gave no reason (") + error_code_name(error.code) + ")";
  }

  // Say each detail that the message does not say already.
  std::size_t num_details = 0;
  for (const google::protobuf::Any& detail : status.details()) {
    if (detail.Is<google::rpc::RetryInfo>()) {
      if (error.code == ErrorCode::kResourceExhausted) error.code = ErrorCode::kUnavailable;
      continue;
    }
    // What the server is like, not what it was sent.
    google::rpc::QuotaFailure quota;
    if (detail.UnpackTo(&quota) && is_lack_of_room(quota)) error.code = ErrorCode::kFailedPrecondition;
    for (const std::string& words : details_in_words(detail)) {
      if (words.empty() || error.message.find(words) != std::string::npos) continue;
      if (++num_details <= kMaxDetailsShown) error.message += "; " + words;
    }
  }
  if (num_details > kMaxDetailsShown) {
    error.message += "; and " + std::to_string(num_details - kMaxDetailsShown) + " more";
  }
  return error;
}

}  // namespace radbake::api
