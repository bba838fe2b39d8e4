#pragma once

#include <string>

#include "common/base/result.h"
#include "google/rpc/status.pb.h"

namespace radbake::api {

/// A google.rpc.Status as an Error: its message, and its details (BadRequest, PreconditionFailure, QuotaFailure) in
/// words. A quota that frees up by itself (RetryInfo) is kUnavailable.
/// Precondition: the status is not OK.
Error to_error(const google::rpc::Status& status);

}  // namespace radbake::api
