#pragma once

#include <grpcpp/server.h>

#include <functional>
#include <memory>
#include <vector>

#include "common/codec/scene_codec.h"
#include "radbake/v1/worker.grpc.pb.h"
#include "tests/unit/worker/fake_bake.h"

namespace radbake {

using WorkerStream = grpc::ServerReaderWriter<v1::WorkerCommand, v1::WorkerReport>;
/// The server's part of a conversation.
using Conversation = std::function<void(WorkerStream&)>;

/// The server's end of a worker's socket, with one conversation written in the test.
class WorkerServer {
 public:
  explicit WorkerServer(Conversation conversation);
  ~WorkerServer();

  /// The worker's end. The channel or process that takes it closes it.
  int worker_fd() const { return worker_fd_; }

 private:
  class Service;
  std::unique_ptr<Service> service_;
  std::unique_ptr<grpc::Server> server_;
  int worker_fd_ = -1;
};

/// Blobs as open files without a name, closed at the end.
class BlobFiles {
 public:
  explicit BlobFiles(const EncodedScene& scene);
  ~BlobFiles();
  BlobFiles(const BlobFiles&) = delete;

  /// An order to bake or plan the scene, with all blobs as inputs.
  v1::WorkerCommand order(FakeBake what, bool is_plan = false) const;

 private:
  v1::WorkerCommand order_;
  std::vector<int> descriptors_;
};

/// A quad under a lamp.
EncodedScene small_scene();

/// Reads reports until an outcome, which is the last.
std::vector<v1::WorkerReport> read_to_outcome(WorkerStream& stream);

/// Tells the worker that all is stored.
void accept(WorkerStream& stream);

}  // namespace radbake
