#pragma once

#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "radbake/v1/bake.grpc.pb.h"
#include "radbake/v1/content.grpc.pb.h"
#include "radbake/v1/server.grpc.pb.h"

namespace radbake::api {

/// A server in memory, in this process, that can be told to fail. Keeps what the client sent.
class FakeServer final : v1::Content::Service, v1::Bakes::Service, v1::Server::Service {
 public:
  FakeServer();
  ~FakeServer() override;

  std::string address() const { return "unix:" + (folder_ / "socket").string(); }

  // What the server answers; set before the client calls.
  v1::Capabilities capabilities;
  int calls_to_refuse = 0;                ///< the next unary calls answer UNAVAILABLE
  std::size_t break_uploads_at = 0;       ///< bytes of a blob after which its first upload breaks; 0: never
  bool forget_broken_uploads = false;     ///< as a server that was restarted
  std::size_t break_downloads_after = 0;  ///< bytes after which each download breaks; 0: never
  grpc::Status submit_status;             ///< of SubmitBake
  std::vector<v1::BakeEvent> events;      ///< of every bake
  std::size_t break_watches_after = 0;    ///< events after which a watch breaks; 0: never
  bool break_watches_at_snapshot = false;
  bool hold_watches = false;  ///< a watch stays silent after its snapshot until it is cancelled
  v1::Bake finished;          ///< the end of every bake
  int num_bakes = 0;          ///< in the list
  int page_size = 2;          ///< of the list

  // What the server saw.
  std::map<std::string, std::string> blobs;   ///< by SHA-256
  std::vector<std::uint64_t> upload_offsets;  ///< at which uploads started
  std::vector<std::size_t> find_missing_sizes;
  std::vector<std::uint64_t> download_offsets;
  std::vector<std::uint64_t> watch_sequences;
  std::vector<std::string> request_ids;
  std::vector<std::string> to_finish;  ///< names
  std::string protocol;                ///< the metadata of the last unary call

 private:
  using Context = grpc::ServerContext;
  grpc::Status unary(const Context& context);

  grpc::Status GetCapabilities(Context*, const v1::GetCapabilitiesRequest*, v1::Capabilities*) override;
  grpc::Status FindMissing(Context*, const v1::FindMissingRequest*, v1::FindMissingResponse*) override;
  grpc::Status Upload(Context*, grpc::ServerReaderWriter<v1::UploadResult, v1::UploadChunk>* stream) override;
  grpc::Status QueryUpload(Context*, const v1::QueryUploadRequest*, v1::QueryUploadResponse*) override;
  grpc::Status Download(Context*, const v1::DownloadRequest*, grpc::ServerWriter<v1::DownloadChunk>*) override;
  grpc::Status SubmitBake(Context*, const v1::SubmitBakeRequest*, v1::Bake*) override;
  grpc::Status ListBakes(Context*, const v1::ListBakesRequest*, v1::ListBakesResponse*) override;
  grpc::Status GetBake(Context*, const v1::GetBakeRequest*, v1::Bake*) override;
  grpc::Status FinishBake(Context*, const v1::FinishBakeRequest*, v1::Bake*) override;
  grpc::Status WatchBake(Context*, const v1::WatchBakeRequest*, grpc::ServerWriter<v1::WatchBakeResponse>*) override;

  std::filesystem::path folder_;
  std::mutex mutex_;
  std::map<std::string, std::string> partial_;
  bool upload_was_broken_ = false;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace radbake::api
