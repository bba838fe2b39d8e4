#include <grpc/grpc.h>
#include <grpcpp/create_channel_posix.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <utility>

#include "common/base/digest.h"
#include "common/base/version.h"
#include "common/log/log.h"
#include "server/handover/handover.h"
#include "server/worker/memory_limit.h"
#include "server/worker/run_worker.h"
#include "server/worker/sandbox.h"

using namespace radbake;  // NOLINT(google-build-using-namespace)

int main(int argc, char** argv) {
  worker::WorkerIdentity identity;
  int fd = -1;
  LogOptions log{.program = "radbake-worker"};
  CLI::App app("Bakes one scene. radbaked starts it; it is of no use alone.", "radbake-worker");
  app.add_option("--fd", fd, "Inherited socket that is connected to radbaked")
      ->required()
      ->check(CLI::Range(0, 1 << 20));
  CLI::Option* job = app.add_option("--job", identity.job, "Name of the job");
  CLI::Option* attempt = app.add_option("--attempt", identity.attempt, "Number of this attempt at the job");
  job->needs(attempt);
  attempt->needs(job);
  bool waits = false;
  app.add_flag("--wait", waits, "Wait to be told the job over the socket")->excludes(job)->excludes(attempt);
  app.add_flag("--log-json", log.is_json, "Log JSON lines instead of text");
  app.set_version_flag("--version", std::string("radbake-worker ") + kEngineVersion + ", protocol " +
                                        std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor));
  try {
    app.parse(argc, argv);
    if (!*job && !waits) throw CLI::RequiredError("--job or --wait");
  } catch (const CLI::ParseError& problem) {
    return app.exit(problem) == 0 ? worker::kExitDone : worker::kExitUsage;
  }
  if (const auto ready = set_up_log(log); !ready.ok()) {
    std::cerr << "radbake-worker: " << ready.error().message << '\n';
    return worker::kExitUsage;
  }

  // What takes time and is the same for all jobs, and what reads files.
  grpc_init();
  worker::seconds_since_process_start();
  digest_of("");
  worker::name_lack_of_memory_at_the_end();
  // Before there is anything of a client's.
  if (const auto isolated = worker::enter_sandbox(); !isolated.ok()) spdlog::warn("{}", isolated.error().message);
  double waited_seconds = 0;
  if (waits) {
    if (!handover::announce(fd).ok()) return worker::kExitServerGone;
    auto handed = handover::take(fd);
    if (!handed.ok()) return worker::kExitServerGone;
    waited_seconds = worker::seconds_since_process_start();
    identity.job = std::move(handed->job);
    identity.attempt = handed->attempt;
    identity.inputs = std::move(handed->inputs);
  }
  const auto channel = grpc::CreateInsecureChannelFromFd("radbaked", fd);
  identity.start_seconds = worker::seconds_since_process_start() - waited_seconds;
  return worker::run_worker(channel, identity);
}
