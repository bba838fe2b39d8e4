#pragma once

#include <string>

#include "common/base/result.h"
#include "server/access/caller.h"

namespace radbake::access {

/// Who a client's certificate (PEM) names. Its signature and dates are the handshake's affair.
///
///   tenant: the subject's CN, else the first DNS or URI name among the subject's alternative names
///   role:   admin where the subject has OU=admin, else submit
///
/// Errors: kInvalidArgument for a certificate without such a name, or with one that cannot be a tenant's.
Result<Caller> caller_of_certificate(const std::string& pem);

}  // namespace radbake::access
