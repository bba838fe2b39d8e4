#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/access/access_options.h"
#include "server/access/caller.h"
#include "server/access/reloaded.h"
#include "server/access/token_set.h"

namespace radbake::service {

/// Who makes a call, or why it is refused.
struct Admission {
  grpc::Status status;    ///< not OK: what to finish the call with
  access::Caller caller;  ///< where the status is OK
};

/// Admits calls. Every handler asks it first: it is the one source of a Caller, which all that is a tenant's asks for.
///
/// A caller is who its certificate names, else whose token it carries (metadata authorization: Bearer TOKEN). Where
/// neither is configured, everybody who can connect is an admin without a tenant.
class Gate {
 public:
  /// Errors: a token file that cannot be read.
  static Result<std::unique_ptr<Gate>> open(const access::AccessOptions& options);

  /// UNAUTHENTICATED for a caller that is not known; FAILED_PRECONDITION for another protocol.
  Admission admit(const grpc::CallbackServerContext& context) const;

 private:
  Gate() = default;
  Result<access::Caller> identify(const grpc::CallbackServerContext& context) const;

  bool knows_callers_ = false;
  std::unique_ptr<access::Reloaded<access::TokenSet>> tokens_;  // null: none are accepted
};

}  // namespace radbake::service
