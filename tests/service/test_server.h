#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "google/rpc/status.pb.h"
#include "radbake/v1/bake.grpc.pb.h"
#include "radbake/v1/content.grpc.pb.h"
#include "radbake/v1/server.grpc.pb.h"
#include "server/service/bake_server.h"
#include "tests/service/fake_worker.h"
#include "tests/service/temporary_folder.h"

namespace radbake::testing {

/// No call of a test waits longer: a failure then, where it would hang.
inline constexpr std::chrono::seconds kCallLimit{60};

/// Everything that a client does, over the generated stubs.
struct TestClient {
  /// token: sent with each call, over whatever the credentials speak.
  explicit TestClient(
      const std::string& address, const std::string& token = "",
      const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials());

  std::unique_ptr<v1::Content::Stub> content;
  std::unique_ptr<v1::Bakes::Stub> bakes;
  std::unique_ptr<v1::Server::Stub> server;
  std::shared_ptr<grpc::Channel> channel;

  /// Uploads in chunks of a size, from an offset on.
  grpc::Status upload(const std::string& bytes, v1::UploadResult* result = nullptr, std::size_t chunk = 1000,
                      std::size_t offset = 0);
  /// Uploads a scene of one mesh; the digest of its manifest.
  v1::Digest upload_scene();
  v1::SubmitBakeRequest request_for(const v1::Digest& manifest, FakeWork work, unsigned num_tiles = 4);
  /// Uploads a scene and submits it.
  v1::Bake submit(FakeWork work, unsigned num_tiles = 4);
  v1::Bake get(const std::string& name);
  grpc::Status cancel(const std::string& name);
  grpc::Status finish(const std::string& name);

  struct Watched {
    grpc::Status status;
    std::vector<v1::WatchBakeResponse> messages;

    std::vector<v1::BakeEvent> events() const;
    std::vector<v1::LayerTile> tiles() const;
    /// The last message's bake; a bake without a name if there was none.
    v1::Bake finished() const;
  };
  /// Watches to the end. pause: after each message, as a slow reader does.
  Watched watch(const std::string& name, std::uint64_t after_sequence = 0, bool include_tiles = false,
                std::chrono::milliseconds pause = {});
  /// Waits until a bake is in a state (or has ended).
  v1::Bake wait_for(const std::string& name, v1::BakeState state);
};

/// The server in this process, with fake workers, on a Unix socket in a temporary folder.
class TestServer {
 public:
  /// Limits short enough for tests. program: a name from fake_worker.h for workers that fail before they get work.
  static service::BakeServerOptions options_in(const std::filesystem::path& folder, const std::string& program = "");

  explicit TestServer(const service::BakeServerOptions& options);

  TestClient client(const std::string& token = "") const { return TestClient(server_->address(), token); }
  service::BakeServer& server() { return *server_; }

 private:
  std::unique_ptr<service::BakeServer> server_;
};

/// Ends the writing of an upload, takes what the server answers, the last of it into `result`, and gives its status.
using UploadStream = grpc::ClientReaderWriter<v1::UploadChunk, v1::UploadResult>;
grpc::Status finish_upload(UploadStream& stream, v1::UploadResult* result = nullptr);

v1::Digest digest_message(const std::string& bytes);

/// The first detail of a type in a status; empty if there is none.
template <typename Detail>
std::optional<Detail> detail_of(const grpc::Status& status) {
  google::rpc::Status rich;
  if (!rich.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& any : rich.details()) {
    Detail detail;
    if (any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

/// A context with a deadline and our protocol's version.
std::unique_ptr<grpc::ClientContext> new_context(const std::string& protocol = "1");

}  // namespace radbake::testing
