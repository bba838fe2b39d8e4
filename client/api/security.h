#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>

#include "client/api/client.h"
#include "common/base/result.h"

namespace radbake::api {

/// What a channel to an address speaks: plain HTTP/2, or TLS where `security` names authorities.
///
/// Errors: kInvalidArgument for options that do not go together, for files that are no PEM and for a token that would
/// travel readable for all; kNotFound for files that are not there.
Result<std::shared_ptr<grpc::ChannelCredentials>> make_credentials(const std::string& address,
                                                                   const ClientSecurity& security);

}  // namespace radbake::api
