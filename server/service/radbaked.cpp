// radbaked: the baking server. Reads its options, starts a BakeServer and waits for a signal to stop it.

#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "common/base/version.h"
#include "common/log/log.h"
#include "server/service/access_options.h"
#include "server/service/bake_server.h"

namespace radbake::service {
namespace {

constexpr int kExitUsage = 2;
constexpr int kExitCannotStart = 4;
constexpr int kExitSecondSignal = 130;

struct ProgramOptions {
  BakeServerOptions server;
  LogOptions log{"radbaked", "info", false};
  bool is_bound_to_parent = false;
  bool hashes_token = false;
};

std::filesystem::path default_data_folder() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data && *data) return std::filesystem::path(data) / "radbake";
  if (const char* home = std::getenv("HOME"); home && *home) {
    return std::filesystem::path(home) / ".local" / "share" / "radbake";
  }
  return "radbake-data";
}

std::filesystem::path default_worker() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "radbake-worker";
}

void declare_options(CLI::App& app, ProgramOptions& options) {
  BakeServerOptions& server = options.server;
  server.data = default_data_folder();
  server.queue.worker.program = default_worker();
  server.queue.keeps_worker_ready = true;
  app.add_option("--listen", server.listen, "HOST:PORT (port 0: any free one) or unix:PATH")
      ->capture_default_str()
      ->type_name("ADDRESS");
  app.add_option("--data", server.data, "Folder for scenes, bakes and results")
      ->capture_default_str()
      ->type_name("DIR");
  app.add_option("--costs", server.costs,
                 "File for what bakes cost on this host, behind predictions; default: DIR/costs.txt")
      ->type_name("FILE");
  app.add_option("--worker", server.queue.worker.program, "The radbake-worker to run")
      ->capture_default_str()
      ->type_name("PATH");
  app.add_option("--threads", server.max_threads, "Threads of a bake at most; 0: all cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--max-running", server.limits.max_running_bakes, "Bakes at the same time")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  declare_access_options(app, server.access);
  declare_call_limits(app, server.limits);
  app.add_flag("--hash-token", options.hashes_token, "Read a token from stdin, print its hash for --tokens, and exit");
  app.add_flag("--log-json", options.log.is_json, "Log JSON lines instead of text");
  app.add_option("--log-level", options.log.level, "trace, debug, info, warning, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--exit-with-parent", options.is_bound_to_parent, "Stop when the process that started this one ends");
  app.set_config("--config", "", "Read options from a file: one name=value a line")->type_name("FILE");
  app.set_version_flag("--version", std::string("radbaked ") + kEngineVersion);
  app.footer(
      "Examples:\n"
      "  radbaked                                     on 127.0.0.1:7419\n"
      "  radbaked --listen 127.0.0.1:0 --data /tmp/r  on a free port, which it prints\n"
      "  radbaked --listen unix:/run/radbake.sock --max-running 2 --threads 8 --log-json\n"
      "  radbaked --listen 0.0.0.0:7419 --tls-cert server.pem --tls-key server.key --tls-client-ca clients.pem\n"
      "  head -c 32 /dev/urandom | base64 | tee token | radbaked --hash-token   makes a token for --tokens\n"
      "\n"
      "Prints 'radbaked VERSION listening on ADDRESS' when it is ready; logs go to stderr. SIGTERM or Ctrl-C stops "
      "it:\n"
      "running bakes go back to the queue and run again at the next start. Where other machines can connect, --listen\n"
      "needs TLS and certificates or tokens of clients; the files of both may change while it runs.");
}

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

int run(const ProgramOptions& options, const sigset_t& signals, pid_t parent) {
  if (auto log = set_up_log(options.log); !log.ok()) {
    std::cerr << "radbaked: " << log.error().message << "\n";
    return kExitUsage;
  }
  BakeServerOptions server_options = options.server;
  server_options.queue.worker.log_json = options.log.is_json;
  if (::access(server_options.queue.worker.program.c_str(), X_OK) != 0) {
    std::cerr << "radbaked: there is no worker program " << server_options.queue.worker.program.string()
              << ": name it with --worker\n";
    return kExitCannotStart;
  }
  auto server = BakeServer::start(std::move(server_options));
  if (!server.ok()) {
    std::cerr << "radbaked: " << server.error().message << "\n";
    return kExitCannotStart;
  }
  std::cout << "radbaked " << kEngineVersion << " listening on " << (*server)->address() << std::endl;

  if (!options.is_bound_to_parent || getppid() == parent) wait_for_stop(signals, parent, options.is_bound_to_parent);
  // A second signal does not wait for anything. Workers end by themselves when their socket breaks.
  std::thread([signals] {
    int signal = SIGUSR1;
    while (signal == SIGUSR1) sigwait(&signals, &signal);
    _exit(kExitSecondSignal);
  }).detach();
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

  ProgramOptions options;
  CLI::App app("The baking server of radbake: stores scenes, bakes them in worker processes, keeps the results.",
               "radbaked");
  declare_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    return app.exit(problem) == 0 ? 0 : kExitUsage;
  }
  if (options.hashes_token) return print_token_hash();
  if (options.is_bound_to_parent) prctl(PR_SET_PDEATHSIG, SIGUSR1);
  return run(options, signals, parent);
}
