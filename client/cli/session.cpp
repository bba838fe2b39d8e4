#include "client/cli/commands.h"

namespace radbake::cli {

Result<Session> open_session(const CommandContext& context) {
  std::optional<api::PrivateServer> private_server;
  std::string address = context.line.server;
  if (address.empty()) {
    Result<api::PrivateServer> started = api::PrivateServer::start({});
    if (!started.ok()) return started.error();
    private_server.emplace(std::move(started).value());
    address = private_server->address();
  }
  Result<api::Client> client = api::Client::connect(address, {}, context.interrupt.once());
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

}  // namespace radbake::cli
