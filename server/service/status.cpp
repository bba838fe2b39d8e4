#include "server/service/status.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/base/shortened.h"
#include "common/base/version.h"
#include "google/rpc/error_details.pb.h"
#include "radbake/v1/server.pb.h"

namespace radbake::service {
namespace {

// Details travel in a header: clients take 8 KiB of those.
constexpr std::size_t kMaxViolations = 20;
constexpr int kRetrySeconds = 1;

constexpr std::array<std::pair<ErrorCode, grpc::StatusCode>, 9> kCodes = {{
    {ErrorCode::kInvalidArgument, grpc::StatusCode::INVALID_ARGUMENT},
    {ErrorCode::kNotFound, grpc::StatusCode::NOT_FOUND},
    {ErrorCode::kAlreadyExists, grpc::StatusCode::ALREADY_EXISTS},
    {ErrorCode::kFailedPrecondition, grpc::StatusCode::FAILED_PRECONDITION},
    {ErrorCode::kResourceExhausted, grpc::StatusCode::RESOURCE_EXHAUSTED},
    {ErrorCode::kDataLoss, grpc::StatusCode::DATA_LOSS},
    {ErrorCode::kUnavailable, grpc::StatusCode::UNAVAILABLE},
    {ErrorCode::kCancelled, grpc::StatusCode::CANCELLED},
    {ErrorCode::kInternal, grpc::StatusCode::INTERNAL},
}};

grpc::StatusCode to_code(ErrorCode code) {
  const auto* found = std::find_if(kCodes.begin(), kCodes.end(), [&](const auto& pair) { return pair.first == code; });
  return found == kCodes.end() ? grpc::StatusCode::INTERNAL : found->second;
}

template <typename... Details>
grpc::Status with_details(grpc::StatusCode code, const std::string& message, const Details&... details) {
  google::rpc::Status status;
  status.set_code(code);
  status.set_message(message);
  (status.add_details()->PackFrom(details), ...);
  return {code, message, status.SerializeAsString()};
}

bool names(const Error& error, const std::string& limit) { return error.message.find(limit) != std::string::npos; }

/// The limit that an error names, else `otherwise`.
std::string limit_of(const Error& error, const std::string& otherwise) {
  const auto* limits = v1::Limits::descriptor();
  for (int i = 0; i < limits->field_count(); ++i) {
    if (names(error, limits->field(i)->name())) return limits->field(i)->name();
  }
  return otherwise;
}

google::rpc::QuotaFailure quota_failure(const std::string& limit, const std::string& message) {
  google::rpc::QuotaFailure quota;
  auto* violation = quota.add_violations();
  violation->set_subject(limit);
  violation->set_description(message);
  return quota;
}

google::rpc::RetryInfo retry_soon() {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(kRetrySeconds);
  return retry;
}

}  // namespace

grpc::Status to_status(const Error& error, const std::string& limit) {
  if (error.code == ErrorCode::kResourceExhausted) {
    return with_details(grpc::StatusCode::RESOURCE_EXHAUSTED, error.message,
                        quota_failure(limit_of(error, limit), error.message));
  }
  if (error.code == ErrorCode::kUnavailable) {
    return with_details(grpc::StatusCode::UNAVAILABLE, error.message, retry_soon());
  }
  return {to_code(error.code), error.message};
}

grpc::Status missing_blobs(const std::vector<Digest>& missing) {
  google::rpc::PreconditionFailure failure;
  for (std::size_t i = 0; i < std::min(missing.size(), kMaxViolations); ++i) {
    auto* violation = failure.add_violations();
    violation->set_type("MISSING");
    violation->set_subject("blobs/" + missing[i].sha256 + "/" + std::to_string(missing[i].size_bytes));
  }
  return with_details(grpc::StatusCode::FAILED_PRECONDITION,
                      std::to_string(missing.size()) + " blobs of the scene are not on the server, the first is " +
                          missing.front().sha256 + ": upload them first",
                      failure);
}

grpc::Status bad_field(const std::string& field, const std::string& description) {
  google::rpc::BadRequest bad;
  auto* violation = bad.add_field_violations();
  violation->set_field(field);
  violation->set_description(description);
  return with_details(grpc::StatusCode::INVALID_ARGUMENT, field + ": " + description, bad);
}

grpc::Status above_limit(const std::string& limit, std::uint64_t value, std::uint64_t bound) {
  const std::string message = std::to_string(value) + " is above " + limit + " " + std::to_string(bound);
  return with_details(grpc::StatusCode::RESOURCE_EXHAUSTED, message, quota_failure(limit, message));
}

grpc::Status busy(const std::string& limit, std::uint64_t bound) {
  return busy(Error{ErrorCode::kResourceExhausted,
                    "as many calls as " + limit + " " + std::to_string(bound) + " allows are going on"},
              limit);
}

grpc::Status busy(const Error& error, const std::string& limit) {
  if (error.code != ErrorCode::kResourceExhausted || !names(error, limit)) return to_status(error, kDiskLimit);
  return with_details(grpc::StatusCode::RESOURCE_EXHAUSTED, error.message, quota_failure(limit, error.message),
                      retry_soon());
}

grpc::Status check_protocol(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  const auto found = metadata.find("radbake-protocol");
  if (found == metadata.end()) return grpc::Status::OK;
  const std::string theirs(found->second.data(), found->second.size());
  if (theirs == std::to_string(kProtocolMajor)) return grpc::Status::OK;
  return {grpc::StatusCode::FAILED_PRECONDITION,
          "the client speaks protocol " + theirs.substr(0, 20) + ", this server (radbaked " + kEngineVersion +
              ") speaks protocol " + std::to_string(kProtocolMajor) + ": use a client of the server's version"};
}

google::rpc::Status to_message(const Error& error) {
  google::rpc::Status status;
  status.set_code(to_code(error.code));
  status.set_message(error.message);
  return status;
}

Error from_message(const google::rpc::Status& status) {
  const auto* found =
      std::find_if(kCodes.begin(), kCodes.end(), [&](const auto& pair) { return pair.second == status.code(); });
  return {found == kCodes.end() ? ErrorCode::kInternal : found->first, shortened(status.message())};
}

}  // namespace radbake::service
