#include "tests/service/test_server.h"

#include <grpcpp/support/client_interceptor.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <utility>

#include "radbake/v1/scene.pb.h"

namespace radbake::testing {

std::unique_ptr<grpc::ClientContext> new_context(const std::string& protocol) {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(std::chrono::system_clock::now() + kCallLimit);
  if (!protocol.empty()) context->AddMetadata("radbake-protocol", protocol);
  return context;
}

v1::Digest digest_message(const std::string& bytes) {
  const Digest digest = digest_of(bytes);
  v1::Digest message;
  message.set_sha256(digest.sha256);
  message.set_size_bytes(digest.size_bytes);
  return message;
}

namespace {

/// Adds a bearer token to each call: gRPC's own way of doing so insists on TLS.
class TokenInterceptor : public grpc::experimental::Interceptor {
 public:
  explicit TokenInterceptor(std::string token) : authorization_("Bearer " + std::move(token)) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", authorization_);
    }
    methods->Proceed();
  }

 private:
  const std::string authorization_;
};

class TokenInterceptors : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenInterceptors(std::string token) : token_(std::move(token)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new TokenInterceptor(token_);
  }

 private:
  const std::string token_;
};

}  // namespace

TestClient::TestClient(const std::string& address, const std::string& token,
                       const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a connection of its own
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (!token.empty()) interceptors.push_back(std::make_unique<TokenInterceptors>(token));
  channel =
      grpc::experimental::CreateCustomChannelWithInterceptors(address, credentials, arguments, std::move(interceptors));
  content = v1::Content::NewStub(channel);
  bakes = v1::Bakes::NewStub(channel);
  server = v1::Server::NewStub(channel);
}

grpc::Status TestClient::upload(const std::string& bytes, v1::UploadResult* result, std::size_t chunk,
                                std::size_t offset) {
  const auto context = new_context();
  const auto stream = content->Upload(context.get());
  for (bool is_first = true; is_first || offset < bytes.size(); is_first = false, offset += chunk) {
    v1::UploadChunk message;
    if (is_first) *message.mutable_digest() = digest_message(bytes);
    message.set_offset(offset);
    message.set_data(bytes.substr(offset, chunk));
    message.set_finish(offset + chunk >= bytes.size());
    if (!stream->Write(message)) break;
  }
  return finish_upload(*stream, result);
}

grpc::Status finish_upload(UploadStream& stream, v1::UploadResult* result) {
  stream.WritesDone();
  v1::UploadResult own_result;
  while (stream.Read(result ? result : &own_result)) continue;
  return stream.Finish();
}

v1::Digest TestClient::upload_scene() {
  const std::string mesh(5000, 'm');
  EXPECT_TRUE(upload(mesh).ok());
  v1::SceneManifest manifest;
  v1::MeshRecord& record = *manifest.add_meshes();
  record.set_name("box");
  *record.mutable_blob() = digest_message(mesh);
  record.set_num_vertices(8);
  record.set_num_triangles(12);
  manifest.add_materials()->set_name("white");
  const std::string bytes = manifest.SerializeAsString();
  EXPECT_TRUE(upload(bytes).ok());
  return digest_message(bytes);
}

v1::SubmitBakeRequest TestClient::request_for(const v1::Digest& manifest, FakeWork work, unsigned num_tiles) {
  static std::atomic<int> num_requests = 0;
  v1::SubmitBakeRequest request;
  request.set_request_id("request " + std::to_string(getpid()) + " " + std::to_string(num_requests++));
  *request.mutable_manifest() = manifest;
  request.mutable_settings()->set_atlas_size(64);
  request.mutable_settings()->set_seed(work);
  request.mutable_settings()->set_transport_memory_bytes(num_tiles);
  request.set_label("box.glb");
  return request;
}

v1::Bake TestClient::submit(FakeWork work, unsigned num_tiles) {
  v1::Bake bake;
  const grpc::Status status =
      bakes->SubmitBake(new_context().get(), request_for(upload_scene(), work, num_tiles), &bake);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return bake;
}

v1::Bake TestClient::get(const std::string& name) {
  v1::GetBakeRequest request;
  request.set_name(name);
  v1::Bake bake;
  const grpc::Status status = bakes->GetBake(new_context().get(), request, &bake);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return bake;
}

grpc::Status TestClient::cancel(const std::string& name) {
  v1::CancelBakeRequest request;
  request.set_name(name);
  v1::Bake bake;
  return bakes->CancelBake(new_context().get(), request, &bake);
}

grpc::Status TestClient::finish(const std::string& name) {
  v1::FinishBakeRequest request;
  request.set_name(name);
  v1::Bake bake;
  return bakes->FinishBake(new_context().get(), request, &bake);
}

TestClient::Watched TestClient::watch(const std::string& name, std::uint64_t after_sequence, bool include_tiles,
                                      std::chrono::milliseconds pause) {
  v1::WatchBakeRequest request;
  request.set_name(name);
  request.set_after_sequence(after_sequence);
  request.set_include_tiles(include_tiles);
  const auto context = new_context();
  const auto stream = bakes->WatchBake(context.get(), request);
  Watched watched;
  v1::WatchBakeResponse message;
  while (stream->Read(&message)) {
    watched.messages.push_back(message);
    std::this_thread::sleep_for(pause);
  }
  watched.status = stream->Finish();
  return watched;
}

std::vector<v1::BakeEvent> TestClient::Watched::events() const {
  std::vector<v1::BakeEvent> events;
  for (const auto& message : messages) {
    if (message.has_event()) events.push_back(message.event());
  }
  return events;
}

std::vector<v1::LayerTile> TestClient::Watched::tiles() const {
  std::vector<v1::LayerTile> tiles;
  for (const auto& message : messages) {
    if (message.has_tile()) tiles.push_back(message.tile());
  }
  return tiles;
}

v1::Bake TestClient::Watched::finished() const { return messages.empty() ? v1::Bake() : messages.back().finished(); }

v1::Bake TestClient::wait_for(const std::string& name, v1::BakeState state) {
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  while (true) {
    v1::Bake bake = get(name);
    const bool has_ended = bake.state() >= v1::SUCCEEDED || bake.state() == v1::BAKE_STATE_UNSPECIFIED;
    if (bake.state() == state || has_ended || std::chrono::steady_clock::now() > limit) return bake;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

service::BakeServerOptions TestServer::options_in(const std::filesystem::path& folder, const std::string& program) {
  service::BakeServerOptions options;
  options.listen = "unix:" + (folder / "socket").string();
  options.data = folder / "data";
  options.queue.worker.program = RADBAKE_FAKE_WORKER;
  if (!program.empty()) {
    // The program's name tells the fake worker what to do.
    options.queue.worker.program = folder / program;
    if (!std::filesystem::exists(options.queue.worker.program)) {
      std::filesystem::create_symlink(RADBAKE_FAKE_WORKER, options.queue.worker.program);
    }
  }
  return options;
}

TestServer::TestServer(const service::BakeServerOptions& options) {
  auto server = service::BakeServer::start(options);
  if (!server.ok()) {
    ADD_FAILURE() << server.error().message;
    std::abort();
  }
  server_ = std::move(server).value();
}

}  // namespace radbake::testing
