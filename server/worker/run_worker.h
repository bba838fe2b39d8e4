#pragma once

#include <grpcpp/channel.h>

#include <memory>

#include "server/worker/run_report.h"

namespace radbake::worker {

inline constexpr int kExitDone = 0;        ///< the server has stored the outcome, good or bad
inline constexpr int kExitUsage = 2;       ///< the command line is wrong
inline constexpr int kExitServerGone = 3;  ///< the connection broke before the server had stored the outcome

/// Does one job: says hello, waits for the order, decodes the scene, plans or bakes it, and reports.
///
/// Failures of the job are reported to the server, not returned. When the server cancels or goes away the bake is
/// stopped. Returns the exit code of the process.
int run_worker(const std::shared_ptr<grpc::Channel>& channel, const WorkerIdentity& identity);

}  // namespace radbake::worker
