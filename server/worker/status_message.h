#pragma once

#include "common/base/result.h"
#include "google/rpc/status.pb.h"

namespace radbake::worker {

/// An error as it goes to the server: gRPC's code of the same name, and the message, shortened.
google::rpc::Status to_message(const Error& error);

}  // namespace radbake::worker
