#include "server/service/rpc_watch.h"

#include <google/protobuf/descriptor.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>

#include "common/base/trace.h"
#include "common/log/log.h"

namespace radbake::service {
namespace {

constexpr const char* kTraceKey = "traceparent";
using Clock = std::chrono::steady_clock;
using Metadata = std::multimap<grpc::string_ref, grpc::string_ref>;
using grpc::experimental::InterceptionHookPoints;

/// The one well-formed traceparent; several are as good as none.
std::optional<TraceContext> find_trace(const Metadata& metadata) {
  const auto [begin, end] = metadata.equal_range(kTraceKey);
  if (begin == end || std::next(begin) != end) return std::nullopt;
  return parse_traceparent(std::string_view(begin->second.data(), begin->second.size()));
}

/// "radbake.v1.Bakes/SubmitBake"; "other" for a method that this server does not have: a label must not be a client's
/// to choose.
std::string method_label(const char* method) {
  std::string name = method == nullptr ? "" : method;
  if (name.starts_with('/')) name.erase(0, 1);
  if (name == "grpc.health.v1.Health/Check" || name == "grpc.health.v1.Health/Watch") return name;
  std::string full_name = name;
  std::replace(full_name.begin(), full_name.end(), '/', '.');
  const auto* known = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(full_name);
  return known == nullptr ? "other" : name;
}

/// An upload whose bytes do not have their digest ends with DATA_LOSS by its client's fault, any other call by ours.
constexpr std::string_view kUpload = "radbake.v1.Content/Upload";

spdlog::level::level_enum level_of(std::string_view method, grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
    case grpc::StatusCode::CANCELLED: return spdlog::level::debug;
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN: return spdlog::level::err;
    case grpc::StatusCode::DATA_LOSS: return method == kUpload ? spdlog::level::info : spdlog::level::err;
    default: return spdlog::level::info;
  }
}

/// One call. Ends with it.
class CallWatch : public grpc::experimental::Interceptor {
 public:
  CallWatch(Metrics& metrics, const char* method) : metrics_(metrics), method_(method_label(method)) {
    metrics_.rpc_began(method_);
  }
  /// A call whose client has gone may end without a status.
  ~CallWatch() override {
    if (!has_ended_) end({grpc::StatusCode::CANCELLED, "the client has gone"});
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* batch) override {
    if (batch->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      if (auto* metadata = batch->GetRecvInitialMetadata()) take_trace(*metadata);
    }
    if (batch->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) end(batch->GetSendStatus());
    batch->Proceed();
  }

 private:
  void take_trace(Metadata& metadata) {
    auto trace = find_trace(metadata);
    if (!trace) {
      trace = new_trace();
      traceparent_ = to_traceparent(*trace);  // lives as long as the call, as the metadata does
      metadata.erase(kTraceKey);
      metadata.emplace(kTraceKey, traceparent_);
    }
    trace_id_ = trace->trace_id;
  }

  void end(const grpc::Status& status) {
    has_ended_ = true;
    const double seconds = std::chrono::duration<double>(Clock::now() - began_at_).count();
    metrics_.rpc_ended(method_, code_name(status.error_code()), seconds);
    const LogTrace trace(trace_id_);
    spdlog::log(level_of(method_, status.error_code()), "{} {} after {:.3f} s{}{}", method_,
                code_name(status.error_code()), seconds, status.error_message().empty() ? "" : ": ",
                status.error_message());
  }

  Metrics& metrics_;
  const std::string method_;
  const Clock::time_point began_at_ = Clock::now();
  std::string traceparent_;
  std::string trace_id_;
  bool has_ended_ = false;
};

}  // namespace

grpc::experimental::Interceptor* RpcWatch::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) {
  return new CallWatch(metrics_, info->method());
}

std::string trace_id_of(const grpc::CallbackServerContext& context) {
  const auto trace = find_trace(context.client_metadata());
  return trace ? trace->trace_id : "";
}

const char* code_name(grpc::StatusCode code) {
  // By number, as the wire has them.
  static constexpr std::array<const char*, 17> kNames = {
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  const auto number = static_cast<std::size_t>(code);
  return number < kNames.size() ? kNames[number] : "UNKNOWN";
}

}  // namespace radbake::service
