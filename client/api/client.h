#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "radbake/v1/bake.pb.h"
#include "radbake/v1/server.pb.h"

namespace radbake::api {

/// Whom a client trusts, and how it proves who it is. Empty: not given.
struct ClientSecurity {
  std::filesystem::path ca;                ///< speak TLS, with a server whose certificate these authorities signed
  std::filesystem::path certificate, key;  ///< the client's own, for a server that asks for them
  std::string token;                       ///< a bearer token: over TLS, or to this machine
};

/// How long a client keeps trying while a server is away, and how long it waits for an answer.
struct ClientOptions {
  std::chrono::milliseconds first_delay{100};  ///< doubles from try to try
  std::chrono::milliseconds max_delay{5000};
  std::chrono::milliseconds connect_limit{5000};     ///< for the handshakes of a connection
  std::chrono::milliseconds call_patience{3000};     ///< sum of the delays of one call
  std::chrono::milliseconds stream_patience{60000};  ///< sum of the delays without news on a transfer or a watch
  std::chrono::milliseconds call_deadline{30000};
  std::chrono::milliseconds plan_deadline{60000};
  std::string name;         ///< as a queue knows this client, to share out turns: ASCII; empty: by its connection
  std::string traceparent;  ///< W3C, sent with every call; empty: the server makes one for each
  ClientSecurity security;
};

/// A blob that the caller keeps in memory.
struct BlobView {
  Digest digest;
  std::string_view bytes;
};

using UploadProgress = std::function<void(std::uint64_t done_bytes, std::uint64_t total_bytes)>;
using WatchCallback = std::function<void(const v1::WatchBakeResponse&)>;

struct WatchOptions {
  std::uint64_t after_sequence = 0;  ///< 0: from the first event
  bool include_tiles = false;
};

struct Connection;  // gRPC's side, private to this folder

/// A typed client of one server. Calls block; a stop request ends each of them with kCancelled.
///
/// Errors: kUnavailable when the server cannot be reached in spite of the retries; else the server's own code and
/// message, with its details in words. All calls are safe to repeat, and are repeated while the server is away.
class Client {
 public:
  /// Connects and checks that both speak one major version of the protocol.
  ///
  /// `address`: HOST:PORT, HOST (port 7419) or unix:PATH.
  /// Errors: kUnavailable when nobody answers; kFailedPrecondition for another protocol version, or where the server
  /// does not accept who calls; kInvalidArgument for security options that do not go together, for files that are
  /// no PEM and for a token that would travel readable for all; kNotFound for files that are not there.
  static Result<Client> connect(const std::string& address, const ClientOptions& options = {},
                                std::stop_token stop = {});
  ~Client();
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  /// As the server answered when it was connected.
  const v1::Capabilities& capabilities() const;

  /// Uploads the blobs that the server has not got; returns the bytes sent. A broken upload goes on where the server
  /// says that it ended. `total_bytes` of the progress counts the missing blobs only.
  /// Precondition: each blob's digest is the digest of its bytes (the server checks).
  Result<std::uint64_t> upload_missing(std::span<const BlobView> blobs, const UploadProgress& progress = {},
                                       std::stop_token stop = {});

  /// A blob's bytes, verified against its digest. A broken download goes on at the byte where it ended.
  /// Errors: kDataLoss when the bytes do not have the digest.
  Result<std::string> download(const Digest& digest, std::stop_token stop = {});

  Result<v1::Bake> submit(const v1::SubmitBakeRequest& request, std::stop_token stop = {});
  Result<v1::Plan> plan(const v1::PlanBakeRequest& request, std::stop_token stop = {});
  Result<v1::Bake> get(const std::string& name, std::stop_token stop = {});
  /// All bakes, newest first, without results.
  Result<std::vector<v1::Bake>> list(std::stop_token stop = {});
  /// Asks a bake to stop; it has not stopped when this returns.
  Result<v1::Bake> cancel(const std::string& name, std::stop_token stop = {});
  /// Asks a bake to end with the best result that it has; it has not ended when this returns.
  Result<v1::Bake> finish(const std::string& name, std::stop_token stop = {});

  /// Follows a bake to its end and returns it in its terminal state. Survives broken streams and restarts of the
  /// server: each event arrives once, in order; after a break the callback sees another snapshot.
  Result<v1::Bake> watch(const std::string& name, const WatchOptions& options, const WatchCallback& callback,
                         std::stop_token stop = {});

 private:
  explicit Client(std::unique_ptr<Connection> connection);
  std::unique_ptr<Connection> connection_;
};

/// A fresh text for SubmitBakeRequest.request_id: 32 hexadecimal digits from the operating system's random source.
std::string make_request_id();

}  // namespace radbake::api
