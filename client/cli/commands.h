#pragma once

#include <optional>
#include <string>

#include "client/api/client.h"
#include "client/api/private_server.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/options.h"
#include "client/cli/reporter.h"
#include "common/base/trace.h"

namespace radbake::cli {

/// What each command works with. Commands report their own errors and return the program's exit code.
struct CommandContext {
  const CommandLine& line;
  Reporter& reporter;
  const Interrupt& interrupt;
  const TraceContext& trace;  ///< of everything that this command causes
};

/// The trace that the environment's TRACEPARENT says that we are part of; a new one where it says none that is valid.
TraceContext trace_of_environment();

ExitCode run_submit(const CommandContext& context);
/// `radbake plan`, and `radbake submit --dry-run`.
ExitCode run_plan(const CommandContext& context);
ExitCode run_list(const CommandContext& context);
ExitCode run_watch(const CommandContext& context);
ExitCode run_cancel(const CommandContext& context);
ExitCode run_finish(const CommandContext& context);
ExitCode run_download(const CommandContext& context);
ExitCode run_capabilities(const CommandContext& context);
/// Of two files; needs no server.
ExitCode run_compare(const CommandContext& context);

/// The server of a command: the one that the command line names, or a private one that ends with this object.
struct Session {
  std::optional<api::PrivateServer> private_server;
  api::Client client;  ///< declared last: gone before its server is stopped

  /// An error of a call, with the end of the private server's log where that server has gone.
  Error explain(Error error) const;
};
Result<Session> open_session(const CommandContext& context);

/// Reports an error and returns its exit code.
ExitCode fail(const CommandContext& context, const Error& error);
ExitCode fail(const CommandContext& context, const Error& error, ExitCode exit_code);
/// The same of open_session(): what is no good before anything was sent are the options.
ExitCode fail_to_connect(const CommandContext& context, const Error& error);
/// The same of a bake that failed or was cancelled, with the trace by which the server's log tells of it.
ExitCode fail_with(const CommandContext& context, const v1::Bake& bake);

}  // namespace radbake::cli
