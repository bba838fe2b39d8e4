#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "client/cli/commands.h"

namespace {

using namespace radbake::cli;

ExitCode run(const CommandContext& context) {
  switch (context.line.command) {
    case Command::kSubmit: return run_submit(context);
    case Command::kPlan: return run_plan(context);
    case Command::kList: return run_list(context);
    case Command::kWatch: return run_watch(context);
    case Command::kCancel: return run_cancel(context);
    case Command::kFinish: return run_finish(context);
    case Command::kDownload: return run_download(context);
    case Command::kCapabilities: return run_capabilities(context);
    case Command::kCompare: return run_compare(context);
  }
  return kUsage;
}

}  // namespace

int main(int argc, char** argv) {
  // A reader of our stdout that goes away must not keep us from cleaning up.
  signal(SIGPIPE, SIG_IGN);
  // gRPC logs what its calls return as errors, which we report: once is enough.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  const std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  const auto parsed = parse_command_line(arguments);
  if (const auto* exit = std::get_if<EarlyExit>(&parsed)) {
    std::fputs(exit->out.c_str(), stdout);
    std::fputs(exit->err.c_str(), stderr);
    return exit->code;
  }
  const CommandLine& line = std::get<CommandLine>(parsed);
  const Interrupt interrupt;
  const radbake::TraceContext trace = trace_of_environment();
  const bool is_stream = (line.command == Command::kSubmit && !line.dry_run) || line.command == Command::kWatch;
  const auto reporter = line.json ? make_json_reporter(is_stream, trace.trace_id) : make_text_reporter();
  return run({line, *reporter, interrupt, trace});
}
