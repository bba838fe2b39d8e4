#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

#include "client/api/client.h"
#include "client/api/status.h"
#include "radbake/v1/bake.grpc.pb.h"
#include "radbake/v1/content.grpc.pb.h"
#include "radbake/v1/server.grpc.pb.h"

namespace radbake::api {

/// What a Client keeps: private to client/api, so that only this folder sees gRPC.
struct Connection {
  std::string address;
  ClientOptions options;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::Server::Stub> server;
  std::unique_ptr<v1::Content::Stub> content;
  std::unique_ptr<v1::Bakes::Stub> bakes;
  v1::Capabilities capabilities;

  /// A failed call's status as an Error that names the server where it cannot be reached.
  Error describe(const grpc::Status& status) const;
};

/// Delays that double from try to try, up to a patience that any success restores.
class Backoff {
 public:
  Backoff(const ClientOptions& options, std::chrono::milliseconds patience)
      : first_delay_(options.first_delay), max_delay_(options.max_delay), patience_(patience) {
    reset();
  }

  void reset() {
    delay_ = first_delay_;
    left_ = patience_;
  }

  /// Sleeps for the next delay. False when the patience is at its end or stop was requested.
  bool wait(std::stop_token stop) {
    if (left_ <= left_.zero() || stop.stop_requested()) return false;
    const auto delay = std::min(delay_, left_);
    std::unique_lock lock(mutex_);
    wakeup_.wait_for(lock, stop, delay, [] { return false; });
    left_ -= delay;
    delay_ = std::min(delay_ * 2, max_delay_);
    return !stop.stop_requested();
  }

 private:
  std::chrono::milliseconds first_delay_, max_delay_, patience_;
  std::chrono::milliseconds delay_{}, left_{};
  std::mutex mutex_;
  std::condition_variable_any wakeup_;
};

/// A context for one call: says the protocol's version, the trace and the token, and is cancelled by the stop token.
class Call {
 public:
  Call(const Connection& connection, std::stop_token stop);
  grpc::ClientContext& context() { return context_; }
  void set_deadline(std::chrono::milliseconds limit) {
    context_.set_deadline(std::chrono::system_clock::now() + limit);
  }

 private:
  struct Cancel {
    grpc::ClientContext* context;
    void operator()() const { context->TryCancel(); }
  };
  grpc::ClientContext context_;
  std::stop_callback<Cancel> on_stop_;
};

/// Ends a stream that is of no more use. gRPC wants it read to its end all the same.
template <typename Response>
void abandon(Call& call, grpc::ClientReader<Response>& reader) {
  call.context().TryCancel();
  Response ignored;
  while (reader.Read(&ignored)) continue;
  reader.Finish();
}

inline Error stopped() { return {ErrorCode::kCancelled, "stopped"}; }

/// Makes a unary call, again and again while the server is away.
/// `call`: grpc::Status(grpc::ClientContext*, Response*).
template <typename Response, typename UnaryCall>
Result<Response> call_with_retries(const Connection& connection, std::chrono::milliseconds deadline,
                                   std::stop_token stop, UnaryCall call) {
  Backoff backoff(connection.options, connection.options.call_patience);
  while (true) {
    Call attempt(connection, stop);
    attempt.set_deadline(deadline);
    Response response;
    const grpc::Status status = call(&attempt.context(), &response);
    if (status.ok()) return response;
    if (stop.stop_requested()) return stopped();
    // A deadline that passed is not tried again: the next try would take as long.
    const Error error = connection.describe(status);
    const bool try_again =
        error.code == ErrorCode::kUnavailable && status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED;
    if (!try_again || !backoff.wait(stop)) return stop.stop_requested() ? stopped() : error;
  }
}

}  // namespace radbake::api
