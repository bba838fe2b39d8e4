// radbaked: the baking server. Reads its configuration, starts a BakeServer and waits for a signal to stop it.

#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <iostream>
#include <string>
#include <thread>
#include <utility>

#include "common/base/version.h"
#include "common/log/log.h"
#include "server/access/token_set.h"
#include "server/service/bake_server.h"
#include "server/service/notify.h"
#include "server/service/server_config.h"

namespace radbake::service {
namespace {

constexpr int kExitUsage = 2;
constexpr int kExitCannotStart = 4;
constexpr int kExitSecondSignal = 130;

/// Waits for SIGTERM or SIGINT, or with --exit-with-parent for the end of the parent.
void wait_for_stop(const sigset_t& signals, pid_t parent, bool is_bound_to_parent) {
  while (true) {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) continue;
    if (signal == SIGUSR1) {
      // Sent when the thread that started us ends, which need not be the end of its process.
      if (!is_bound_to_parent || getppid() == parent) continue;
      return spdlog::info("the parent has ended: stopping");
    }
    return spdlog::info("SIG{}: stopping", sigabbrev_np(signal));
  }
}

int fail(const Error& error, int exit_code) {
  std::cerr << "radbaked: " << error.message << "\n";
  return exit_code;
}

/// Reads a token from stdin, up to the end of its line, and prints its hash for a file of tokens.
int print_token_hash() {
  std::string token;
  std::getline(std::cin, token);
  const auto hash = access::hash_token(token);
  if (!hash.ok()) return fail(Error{hash.error().code, "hash-token: " + hash.error().message}, kExitUsage);
  std::cout << *hash << "\n";
  return 0;
}

int run(const ServerConfig& config, const sigset_t& signals, pid_t parent) {
  if (auto log = set_up_log(config.log); !log.ok()) return fail(log.error(), kExitUsage);
  if (auto host = check_host(config); !host.ok()) return fail(host.error(), kExitCannotStart);
  BakeServerOptions options = config.server;
  options.queue.worker.log_json = config.log.is_json;
  auto server = BakeServer::start(std::move(options));
  if (!server.ok()) return fail(server.error(), kExitCannotStart);
  const std::string program = std::string("radbaked ") + kEngineVersion;
  std::cout << program << " listening on " << (*server)->address() << std::endl;
  const std::string admin = (*server)->admin_address();
  if (!admin.empty()) std::cout << program << " admin on " << admin << std::endl;
  notify_service_manager("READY=1");

  if (!config.is_bound_to_parent || getppid() == parent) wait_for_stop(signals, parent, config.is_bound_to_parent);
  // A second signal does not wait for anything. Workers end by themselves when their socket breaks.
  std::thread([signals] {
    int signal = SIGUSR1;
    while (signal == SIGUSR1) sigwait(&signals, &signal);
    _exit(kExitSecondSignal);
  }).detach();
  notify_service_manager("STOPPING=1");
  (*server)->stop();
  spdlog::info("stopped");
  return 0;
}

}  // namespace
}  // namespace radbake::service

int main(int argc, char** argv) {
  using namespace radbake::service;
  // Before there are threads: each inherits this, so that only sigwait() sees these signals.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  const pid_t parent = getppid();

  const auto parsed = parse_config({argv + 1, argv + argc});
  if (!parsed.ok()) return fail(parsed.error(), kExitUsage);
  if (parsed->answer) {
    std::cout << *parsed->answer << std::flush;
    return 0;
  }
  if (parsed->hashes_token) return print_token_hash();
  if (parsed->config.is_bound_to_parent) prctl(PR_SET_PDEATHSIG, SIGUSR1);
  return run(parsed->config, signals, parent);
}
