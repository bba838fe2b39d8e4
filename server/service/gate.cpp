#include "server/service/gate.h"

#include <grpc/grpc_security_constants.h>

#include <optional>
#include <string>
#include <string_view>

#include "server/access/client_certificate.h"
#include "server/service/status.h"

namespace radbake::service {
namespace {

constexpr std::string_view kBearer = "Bearer ";

/// The peer's certificate, which the handshake has verified; empty if it showed none.
std::string certificate_of(const grpc::CallbackServerContext& context) {
  const auto session = context.auth_context();
  if (!session || !session->IsPeerAuthenticated()) return "";
  const auto values = session->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  return values.empty() ? "" : std::string(values.front().data(), values.front().size());
}

/// The text of the one authorization header. Several: none of them counts.
std::optional<std::string_view> authorization_of(const grpc::CallbackServerContext& context) {
  const auto [begin, end] = context.client_metadata().equal_range("authorization");
  if (begin == end || std::next(begin) != end) return std::nullopt;
  return std::string_view(begin->second.data(), begin->second.size());
}

}  // namespace

Result<std::unique_ptr<Gate>> Gate::open(const access::AccessOptions& options) {
  std::unique_ptr<Gate> gate(new Gate());
  gate->knows_callers_ = options.knows_callers();
  if (!options.tokens.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(gate->tokens_,
                             access::Reloaded<access::TokenSet>::open(
                                 {options.tokens}, [file = options.tokens] { return access::TokenSet::read(file); }));
  }
  return gate;
}

Admission Gate::admit(const grpc::CallbackServerContext& context) const {
  // What speaks another protocol may not know how to say who it is.
  if (auto status = check_protocol(context); !status.ok()) return {status, {}};
  const auto caller = identify(context);
  if (!caller.ok()) return {grpc::Status(grpc::StatusCode::UNAUTHENTICATED, caller.error().message), {}};
  return {grpc::Status::OK, *caller};
}

Result<access::Caller> Gate::identify(const grpc::CallbackServerContext& context) const {
  if (!knows_callers_) return access::Caller{"", access::Role::kAdmin};
  if (const std::string certificate = certificate_of(context); !certificate.empty()) {
    return access::caller_of_certificate(certificate);
  }
  if (!tokens_) return invalid_argument("this server knows its callers by their certificates, and there is none");
  const auto authorization = authorization_of(context);
  if (!authorization) {
    return invalid_argument("this server asks for a token (metadata authorization: Bearer TOKEN), and there is none");
  }
  if (!authorization->starts_with(kBearer)) return invalid_argument("authorization must read: Bearer TOKEN");
  const auto caller = tokens_->current()->find(authorization->substr(kBearer.size()));
  if (!caller) return invalid_argument("the token is not one that this server accepts");
  return *caller;
}

}  // namespace radbake::service
