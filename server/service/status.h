#pragma once

#include <grpcpp/grpcpp.h>

#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "google/rpc/status.pb.h"

namespace radbake::service {

// Errors as the wire knows them: a gRPC status whose details (google.rpc.*) programs can read.

/// What kResourceExhausted is about where the error names no limit: the disk is full to the last byte.
inline constexpr char kDiskLimit[] = "min_free_disk_bytes";

/// The status of an error. Above a limit it carries QuotaFailure, whose subject is the limit that the error's message
/// names, else `limit`; where the server cannot serve now it carries RetryInfo.
grpc::Status to_status(const Error& error, const std::string& limit = "");

/// FAILED_PRECONDITION with a PreconditionFailure MISSING for the first blobs of the list.
grpc::Status missing_blobs(const std::vector<Digest>& missing);

/// INVALID_ARGUMENT with a BadRequest violation of one field of the request.
grpc::Status bad_field(const std::string& field, const std::string& description);

/// RESOURCE_EXHAUSTED with a QuotaFailure that names a limit and the value that is above it.
grpc::Status above_limit(const std::string& limit, std::uint64_t value, std::uint64_t bound);

/// RESOURCE_EXHAUSTED as above, for a limit on what goes on at the same time: with RetryInfo, as it frees up by itself.
grpc::Status busy(const std::string& limit, std::uint64_t bound);
/// The same of an error that names `limit`; of any other as to_status(), which is told that the disk is full.
grpc::Status busy(const Error& error, const std::string& limit);

/// OK unless the caller says (metadata radbake-protocol) that it speaks another major version than ours.
grpc::Status check_protocol(const grpc::CallbackServerContext& context);

google::rpc::Status to_message(const Error& error);
Error from_message(const google::rpc::Status& status);

}  // namespace radbake::service
