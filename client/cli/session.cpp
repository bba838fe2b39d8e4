#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "client/cli/commands.h"

namespace radbake::cli {
namespace {

/// "ada@bakery", of printable ASCII.
std::string user_and_host() {
  const char* user = std::getenv("USER");
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  std::string name = std::string(user != nullptr ? user : std::to_string(::getuid())) + '@' + host;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c <= ' ' || c > '~'; }, '?');
  return name;
}

api::ClientOptions client_options(const CommandLine& line, const TraceContext& trace) {
  api::ClientOptions options;
  options.name = user_and_host();
  options.traceparent = to_traceparent(trace);
  options.security = line.security;
  options.plan_deadline = std::chrono::milliseconds(std::llround(1000 * line.plan_seconds));
  return options;
}

/// Where a private server keeps what bakes cost on this host: in the user's cache folder. Empty where none can be had;
/// predictions then come from pilots alone.
std::filesystem::path costs_file() {
  namespace fs = std::filesystem;
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  // A relative path is to be ignored: XDG Base Directory Specification.
  if (cache != nullptr && fs::path(cache).is_absolute()) {
    folder = cache;
  } else if (home != nullptr && fs::path(home).is_absolute()) {
    folder = fs::path(home) / ".cache";
  }
  if (folder.empty()) return {};
  std::error_code failure;
  fs::create_directories(folder / "radbake", failure);
  return failure ? fs::path() : folder / "radbake" / "costs";
}

}  // namespace

TraceContext trace_of_environment() {
  TraceContext trace = new_trace();
  const char* outer = std::getenv("TRACEPARENT");
  // Ours is a step of the trace around us: its id, and a parent of our own.
  if (const auto given = parse_traceparent(outer == nullptr ? "" : outer)) {
    trace.trace_id = given->trace_id;
    trace.is_sampled = given->is_sampled;
  }
  return trace;
}

Result<Session> open_session(const CommandContext& context) {
  std::optional<api::PrivateServer> private_server;
  std::string address = context.line.server;
  if (address.empty()) {
    Result<api::PrivateServer> started = api::PrivateServer::start({.program = {}, .costs = costs_file()});
    if (!started.ok()) return started.error();
    private_server.emplace(std::move(started).value());
    address = private_server->address();
  }
  Result<api::Client> client =
      api::Client::connect(address, client_options(context.line, context.trace), context.interrupt.once());
  if (!client.ok()) {
    Error error = client.error();
    if (private_server) error.message += private_server->log_tail();
    return error;
  }
  return Session{std::move(private_server), std::move(client).value()};
}

Error Session::explain(Error error) const {
  if (private_server && error.code == ErrorCode::kUnavailable) error.message += private_server->log_tail();
  return error;
}

ExitCode fail(const CommandContext& context, const Error& error, ExitCode exit_code) {
  context.reporter.failed(error, exit_code);
  return exit_code;
}

ExitCode fail(const CommandContext& context, const Error& error) {
  return fail(context, error, exit_code_of(error.code));
}

ExitCode fail_to_connect(const CommandContext& context, const Error& error) {
  return fail(context, error, error.code == ErrorCode::kInvalidArgument ? kUsage : exit_code_of(error.code));
}

ExitCode fail_with(const CommandContext& context, const v1::Bake& bake) {
  Error error = error_of(bake);
  if (!bake.trace_id().empty()) {
    context.reporter.set_trace(bake.trace_id());
    if (bake.state() == v1::FAILED) error.message += " [trace " + bake.trace_id() + "]";
  }
  return fail(context, error, exit_code_of(bake));
}

}  // namespace radbake::cli
