#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/log/log.h"
#include "server/service/bake_server.h"

namespace radbake::service {

/// Everything that radbaked can be told.
struct ServerConfig {
  BakeServerOptions server;
  LogOptions log{"radbaked", "info", false};
  bool is_bound_to_parent = false;  ///< stops when the process that started it ends
  bool is_admin_port_open = false;  ///< the admin port may listen on more than the loopback
};

/// What a command line comes to.
struct ParsedConfig {
  ServerConfig config;
  bool hashes_token = false;          ///< --hash-token: do nothing else
  std::optional<std::string> answer;  ///< of --help, --version and --print-config: print it and end
};

/// Reads the command line, and the file that it names with --config; the command line wins.
///
/// Errors: kInvalidArgument with one line: the key, its value and what was expected, and the line if it is the file's.
/// That goes for values that contradict each other too.
Result<ParsedConfig> parse_config(const std::vector<std::string>& arguments);

/// Checks what shows only on this host: the data folder, the worker's program.
/// Errors: kFailedPrecondition, as above.
Result<void> check_host(const ServerConfig& config);

}  // namespace radbake::service
