#include "client/api/client.h"

#include <grpc/grpc.h>

#include <mutex>
#include <utility>

#include "client/api/connection.h"
#include "client/api/diagnosis.h"
#include "client/api/security.h"
#include "common/base/check.h"
#include "common/base/trace.h"
#include "common/base/version.h"

namespace radbake::api {
namespace {

constexpr char kDefaultPort[] = "7419";
/// Where a server cannot be reached, gRPC itself waits between tries: no longer than we do.
constexpr int kMaxReconnectMs = 1000;
/// A peer that vanished without a word is noticed after a minute and a half.
constexpr int kKeepaliveMs = 60000, kKeepaliveTimeoutMs = 20000;
/// The largest answer is a page of bakes or a plan with its warnings.
constexpr int kMaxReceiveBytes = 4 << 20;
constexpr std::size_t kRequestIdBytes = 16;

/// gRPC's target for an address as people write it.
std::string target_of(const std::string& address) {
  if (address.rfind("unix:", 0) == 0) return address;
  // [::1] and ::1 hold colons that start no port.
  const std::size_t bracket = address.rfind(']');
  const std::size_t colon = address.find(':', bracket == std::string::npos ? 0 : bracket);
  if (colon != std::string::npos) return address;
  return address + ":" + kDefaultPort;
}

/// Keeps gRPC up until the process ends: never paid back. Else, when the last gRPC object goes, the library stops its
/// threads, and one that polls for a socket's writes may be waited for as long as 10 s.
void keep_grpc_up() {
  static std::once_flag done;
  std::call_once(done, grpc_init);
}

}  // namespace

Call::Call(const Connection& connection, std::stop_token stop) : on_stop_(std::move(stop), Cancel{&context_}) {
  context_.AddMetadata("radbake-protocol", std::to_string(kProtocolMajor));
  if (!connection.options.name.empty()) context_.AddMetadata("radbake-client", connection.options.name);
  if (!connection.options.traceparent.empty()) context_.AddMetadata("traceparent", connection.options.traceparent);
  const std::string& token = connection.options.security.token;
  if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
}

Error Connection::describe(const grpc::Status& status) const {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) details.Clear();
  details.set_code(status.error_code());
  details.set_message(status.error_message());
  Error error = to_error(details);
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    error.message = "server " + address + " did not answer in time";
  } else if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    error.message = "server " + address + " cannot be reached: " + error.message;
  }
  return error;
}

Client::Client(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
Client::~Client() = default;
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

const v1::Capabilities& Client::capabilities() const { return connection_->capabilities; }

Result<Client> Client::connect(const std::string& address, const ClientOptions& options, std::stop_token stop) {
  keep_grpc_up();
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, static_cast<int>(options.first_delay.count()));
  // Whatever it is called, gRPC takes it for the time that a connection may take to stand.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, static_cast<int>(options.connect_limit.count()));
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  // A bake server stands in one's own network; a web proxy does not lead there.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  arguments.SetUserAgentPrefix(std::string("radbake/") + kEngineVersion);

  RADBAKE_ASSIGN_OR_RETURN(const auto credentials, make_credentials(address, options.security));
  auto connection = std::make_unique<Connection>();
  connection->address = address;
  connection->options = options;
  connection->channel = grpc::CreateCustomChannel(target_of(address), credentials, arguments);
  connection->server = v1::Server::NewStub(connection->channel);
  connection->content = v1::Content::NewStub(connection->channel);
  connection->bakes = v1::Bakes::NewStub(connection->channel);

  auto answer = call_with_retries<v1::Capabilities>(
      *connection, options.call_deadline, stop, [&](grpc::ClientContext* context, v1::Capabilities* response) {
        return connection->server->GetCapabilities(context, v1::GetCapabilitiesRequest(), response);
      });
  if (!answer.ok()) {
    // gRPC does not say why a handshake failed.
    Error error = answer.error();
    if (error.code != ErrorCode::kUnavailable) return error;
    const std::string reason = diagnose_tls(target_of(address), options.security);
    if (!reason.empty()) error.message = "server " + address + " cannot be reached: " + reason;
    return error;
  }
  connection->capabilities = std::move(answer).value();
  const v1::Capabilities& capabilities = connection->capabilities;
  if (capabilities.protocol_major() != kProtocolMajor) {
    return Error{ErrorCode::kFailedPrecondition,
                 "server " + address + " (version " + capabilities.engine_version() + ") speaks protocol " +
                     std::to_string(capabilities.protocol_major()) + ", this client " + kEngineVersion +
                     " speaks protocol " + std::to_string(kProtocolMajor) + ": use one version on both sides"};
  }
  return Client(std::move(connection));
}

Result<v1::Bake> Client::submit(const v1::SubmitBakeRequest& request, std::stop_token stop) {
  // What is only validated is planned meanwhile.
  const ClientOptions& options = connection_->options;
  return call_with_retries<v1::Bake>(
      *connection_, request.validate_only() ? options.plan_deadline : options.call_deadline, stop,
      [&](auto* context, auto* response) { return connection_->bakes->SubmitBake(context, request, response); });
}

Result<v1::Plan> Client::plan(const v1::PlanBakeRequest& request, std::stop_token stop) {
  return call_with_retries<v1::Plan>(
      *connection_, connection_->options.plan_deadline, stop,
      [&](auto* context, auto* response) { return connection_->bakes->PlanBake(context, request, response); });
}

Result<v1::Bake> Client::get(const std::string& name, std::stop_token stop) {
  v1::GetBakeRequest request;
  request.set_name(name);
  return call_with_retries<v1::Bake>(
      *connection_, connection_->options.call_deadline, stop,
      [&](auto* context, auto* response) { return connection_->bakes->GetBake(context, request, response); });
}

Result<std::vector<v1::Bake>> Client::list(std::stop_token stop) {
  std::vector<v1::Bake> bakes;
  v1::ListBakesRequest request;
  do {
    RADBAKE_ASSIGN_OR_RETURN(
        v1::ListBakesResponse page,
        call_with_retries<v1::ListBakesResponse>(
            *connection_, connection_->options.call_deadline, stop,
            [&](auto* context, auto* response) { return connection_->bakes->ListBakes(context, request, response); }));
    for (v1::Bake& bake : *page.mutable_bakes()) bakes.push_back(std::move(bake));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return bakes;
}

Result<v1::Bake> Client::cancel(const std::string& name, std::stop_token stop) {
  v1::CancelBakeRequest request;
  request.set_name(name);
  return call_with_retries<v1::Bake>(
      *connection_, connection_->options.call_deadline, stop,
      [&](auto* context, auto* response) { return connection_->bakes->CancelBake(context, request, response); });
}

Result<v1::Bake> Client::finish(const std::string& name, std::stop_token stop) {
  v1::FinishBakeRequest request;
  request.set_name(name);
  return call_with_retries<v1::Bake>(
      *connection_, connection_->options.call_deadline, stop,
      [&](auto* context, auto* response) { return connection_->bakes->FinishBake(context, request, response); });
}

std::string make_request_id() { return random_hex(kRequestIdBytes); }

}  // namespace radbake::api
