#pragma once

#include "common/base/result.h"
#include "radbake/v1/bake.pb.h"

namespace radbake::cli {

/// What the program's exit says to a script. Part of the interface: never renumbered.
enum ExitCode : int {
  kDone = 0,
  kUsage = 2,
  kBadScene = 3,
  kServerUnreachable = 4,  ///< or it does not take what was sent: no room, no access, another protocol
  kBakeFailed = 5,
  kCancelledExit = 6,
  kTargetMissed = 7,  ///< submit --strict: all is written, and the error that was asked for was not reached
  kLeft = 130,        ///< Ctrl-C in watch, as shells say it: the bake goes on
};

/// The exit code for a call that failed.
ExitCode exit_code_of(ErrorCode code);

/// The exit code for a bake in its terminal state.
ExitCode exit_code_of(const v1::Bake& bake);

/// Why a bake has no result, for people. Precondition: the bake failed or was cancelled.
Error error_of(const v1::Bake& bake);

}  // namespace radbake::cli
