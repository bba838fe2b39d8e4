#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/access/access_options.h"

namespace radbake::service {

/// What a server speaks: plain HTTP/2, or TLS whose files are looked at again, at most once a second, when a client
/// connects. Open connections keep what they began with; files that do not go together leave what was in force.
///
/// With client_ca a client must show a certificate that it signed; with tokens too, it may.
/// Errors: those of read_tls_files().
Result<std::shared_ptr<grpc::ServerCredentials>> make_credentials(const access::AccessOptions& options);

}  // namespace radbake::service
