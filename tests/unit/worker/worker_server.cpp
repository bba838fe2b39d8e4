#include "tests/unit/worker/worker_server.h"

#include <fcntl.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/server_posix.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>
#include <utility>

namespace radbake {

class WorkerServer::Service : public v1::Workers::Service {
 public:
  explicit Service(Conversation conversation) : conversation_(std::move(conversation)) {}

  grpc::Status Report(grpc::ServerContext*, WorkerStream* stream) override {
    conversation_(*stream);
    return grpc::Status::OK;
  }

 private:
  const Conversation conversation_;
};

WorkerServer::WorkerServer(Conversation conversation) : service_(std::make_unique<Service>(std::move(conversation))) {
  grpc::ServerBuilder builder;
  builder.RegisterService(service_.get());
  server_ = builder.BuildAndStart();
  int ends[2];
  if (!server_ || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) {
    throw std::runtime_error("cannot start a server");
  }
  ::fcntl(ends[0], F_SETFD, FD_CLOEXEC);
  grpc::AddInsecureChannelFromFd(server_.get(), ends[0]);
  worker_fd_ = ends[1];
}

WorkerServer::~WorkerServer() { server_->Shutdown(std::chrono::system_clock::now()); }

BlobFiles::BlobFiles(const EncodedScene& scene) {
  v1::StartWork& start = *order_.mutable_start();
  *start.mutable_limits() = default_limits();
  start.mutable_run()->set_threads(2);
  for (const EncodedBlob& blob : scene.blobs) {
    const int fd = ::memfd_create("blob", 0);
    if (fd < 0 || ::write(fd, blob.bytes.data(), blob.bytes.size()) != static_cast<ssize_t>(blob.bytes.size())) {
      throw std::runtime_error("cannot write a blob");
    }
    descriptors_.push_back(fd);
    v1::InputBlob& input = *start.add_inputs();
    input.set_fd(fd);
    input.mutable_digest()->set_sha256(blob.digest.sha256);
    input.mutable_digest()->set_size_bytes(blob.digest.size_bytes);
  }
  *start.mutable_manifest() = start.inputs().rbegin()->digest();
}

BlobFiles::~BlobFiles() {
  for (const int fd : descriptors_) ::close(fd);
}

v1::WorkerCommand BlobFiles::order(FakeBake what, bool is_plan) const {
  v1::WorkerCommand order = order_;
  order.mutable_start()->set_plan_only(is_plan);
  order.mutable_start()->mutable_settings()->set_seed(what);
  return order;
}

EncodedScene small_scene() {
  Scene scene;
  Mesh mesh;
  mesh.name = "node/floor#0";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  mesh.texcoord1 = {{0.1, 0.1}, {0.9, 0.1}, {0.9, 0.9}, {0.1, 0.9}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  scene.meshes = {mesh};
  scene.materials.resize(1);
  scene.lights = {{"lamp", PointLight{{0, 1, 0}, {1, 1, 1}}}};
  return *encode_scene(scene, {});
}

std::vector<v1::WorkerReport> read_to_outcome(WorkerStream& stream) {
  std::vector<v1::WorkerReport> reports;
  v1::WorkerReport report;
  while (stream.Read(&report)) {
    reports.push_back(report);
    if (report.has_bake_finished() || report.has_plan_finished() || report.has_failed() || report.has_cancelled()) {
      return reports;
    }
  }
  ADD_FAILURE() << "the worker ended without an outcome";
  return reports;
}

void accept(WorkerStream& stream) {
  v1::WorkerCommand accepted;
  accepted.mutable_accepted();
  stream.Write(accepted);
}

}  // namespace radbake
