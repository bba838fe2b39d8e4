#include "client/cli/exit_code.h"

#include "client/api/status.h"

namespace radbake::cli {

ExitCode exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kResourceExhausted:
    case ErrorCode::kDataLoss: return kBadScene;
    case ErrorCode::kNotFound:
    case ErrorCode::kAlreadyExists: return kUsage;
    case ErrorCode::kFailedPrecondition:
    case ErrorCode::kUnavailable: return kServerUnreachable;
    case ErrorCode::kCancelled: return kCancelledExit;
    case ErrorCode::kInternal: return kBakeFailed;
  }
  return kBakeFailed;
}

ExitCode exit_code_of(const v1::Bake& bake) {
  if (bake.state() == v1::SUCCEEDED) return kDone;
  if (bake.state() == v1::CANCELLED) return kCancelledExit;
  // A bake fails by its scene or by itself; that the server could be reached is known.
  return exit_code_of(api::to_error(bake.error()).code) == kBadScene ? kBadScene : kBakeFailed;
}

Error error_of(const v1::Bake& bake) {
  if (bake.state() == v1::CANCELLED) return {ErrorCode::kCancelled, bake.name() + " was cancelled"};
  Error error = api::to_error(bake.error());
  error.message = bake.name() + " failed: " + error.message;
  return error;
}

}  // namespace radbake::cli
