#include <grpcpp/create_channel_posix.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "common/base/version.h"
#include "common/log/log.h"
#include "server/worker/run_worker.h"

using namespace radbake;  // NOLINT(google-build-using-namespace)

int main(int argc, char** argv) {
  worker::WorkerIdentity identity;
  int fd = -1;
  LogOptions log{.program = "radbake-worker"};
  CLI::App app("Bakes one scene. radbaked starts it; it is of no use alone.", "radbake-worker");
  app.add_option("--fd", fd, "Inherited socket that is connected to radbaked")
      ->required()
      ->check(CLI::Range(0, 1 << 20));
  app.add_option("--job", identity.job, "Name of the job")->required();
  app.add_option("--attempt", identity.attempt, "Number of this attempt at the job")->required();
  app.add_flag("--log-json", log.is_json, "Log JSON lines instead of text");
  app.set_version_flag("--version", std::string("radbake-worker ") + kEngineVersion + ", protocol " +
                                        std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    return app.exit(problem) == 0 ? worker::kExitDone : worker::kExitUsage;
  }
  if (const auto ready = set_up_log(log); !ready.ok()) {
    std::cerr << "radbake-worker: " << ready.error().message << '\n';
    return worker::kExitUsage;
  }

  const auto channel = grpc::CreateInsecureChannelFromFd("radbaked", fd);
  identity.start_seconds = worker::seconds_since_process_start();
  return worker::run_worker(channel, identity);
}
