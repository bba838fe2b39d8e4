#pragma once

#include "common/base/limits.h"
#include "server/access/access_options.h"

namespace CLI {
class App;
}

namespace radbake::service {

/// Declares the options that say who may call, and over what.
void declare_access_options(CLI::App& app, access::AccessOptions& options);

/// Declares the limits on connections and on calls that go on at the same time.
void declare_call_limits(CLI::App& app, Limits& limits);

/// Reads a token from stdin, up to the end of its line, and prints its hash for --tokens. Returns the program's exit
/// code.
int print_token_hash();

}  // namespace radbake::service
