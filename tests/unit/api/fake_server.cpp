#include "tests/unit/api/fake_server.h"

#include <stdlib.h>

#include <chrono>
#include <thread>

#include "common/base/digest.h"
#include "common/base/version.h"

namespace radbake::api {
namespace {

constexpr std::size_t kChunkBytes = 1000;  // many chunks from few bytes
const grpc::Status kAway(grpc::StatusCode::UNAVAILABLE, "away");

}  // namespace

FakeServer::FakeServer() {
  std::string path = (std::filesystem::temp_directory_path() / "fake-radbaked-XXXXXX").string();
  folder_ = mkdtemp(path.data());
  capabilities.set_engine_version(kEngineVersion);
  capabilities.set_protocol_major(kProtocolMajor);
  capabilities.set_protocol_minor(kProtocolMinor);
  capabilities.mutable_limits()->set_chunk_bytes(kChunkBytes);
  capabilities.mutable_limits()->set_max_digests_per_call(3);
  finished.set_state(v1::SUCCEEDED);
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address(), grpc::InsecureServerCredentials());
  builder.RegisterService(static_cast<v1::Content::Service*>(this));
  builder.RegisterService(static_cast<v1::Bakes::Service*>(this));
  builder.RegisterService(static_cast<v1::Server::Service*>(this));
  server_ = builder.BuildAndStart();
}

FakeServer::~FakeServer() {
  server_->Shutdown(std::chrono::system_clock::now());
  std::filesystem::remove_all(folder_);
}

grpc::Status FakeServer::unary(const Context& context) {
  const auto found = context.client_metadata().find("radbake-protocol");
  protocol = found == context.client_metadata().end() ? "" : std::string(found->second.data(), found->second.size());
  if (calls_to_refuse == 0) return {};
  --calls_to_refuse;
  return kAway;
}

grpc::Status FakeServer::GetCapabilities(Context* context, const v1::GetCapabilitiesRequest*,
                                         v1::Capabilities* response) {
  const std::scoped_lock lock(mutex_);
  *response = capabilities;
  return unary(*context);
}

grpc::Status FakeServer::FindMissing(Context* context, const v1::FindMissingRequest* request,
                                     v1::FindMissingResponse* response) {
  const std::scoped_lock lock(mutex_);
  find_missing_sizes.push_back(request->digests_size());
  for (const v1::Digest& digest : request->digests()) {
    if (!blobs.contains(digest.sha256())) *response->add_missing() = digest;
  }
  return unary(*context);
}

grpc::Status FakeServer::Upload(Context*, grpc::ServerReaderWriter<v1::UploadResult, v1::UploadChunk>* stream) {
  v1::UploadChunk chunk;
  v1::UploadResult answer;
  std::string sha256;
  bool tells_progress = false;
  while (stream->Read(&chunk)) {
    const std::scoped_lock lock(mutex_);
    if (chunk.has_digest()) {
      sha256 = chunk.digest().sha256();
      upload_offsets.push_back(chunk.offset());
      tells_progress = chunk.wants_progress() && capabilities.protocol_minor() > 0;
    }
    std::string& bytes = partial_[sha256];
    if (chunk.offset() != bytes.size()) return {grpc::StatusCode::OUT_OF_RANGE, "gap"};
    if (chunk.data().size() > kChunkBytes) return {grpc::StatusCode::RESOURCE_EXHAUSTED, "chunk too large"};
    bytes += chunk.data();
    if (break_uploads_at > 0 && bytes.size() >= break_uploads_at && !upload_was_broken_) {
      upload_was_broken_ = true;
      if (forget_broken_uploads) bytes.clear();
      return kAway;
    }
    answer.set_committed_bytes(bytes.size());
    if (!chunk.finish()) {
      if (tells_progress) stream->Write(answer);
      continue;
    }
    if (digest_of(bytes).sha256 != sha256) return {grpc::StatusCode::DATA_LOSS, "wrong digest"};
    blobs[sha256] = std::move(bytes);
    partial_.erase(sha256);
    stream->Write(answer);
  }
  return {};
}

grpc::Status FakeServer::QueryUpload(Context* context, const v1::QueryUploadRequest* request,
                                     v1::QueryUploadResponse* response) {
  const std::scoped_lock lock(mutex_);
  const std::string& sha256 = request->digest().sha256();
  response->set_complete(blobs.contains(sha256));
  response->set_committed_bytes(response->complete() ? blobs[sha256].size() : partial_[sha256].size());
  return unary(*context);
}

grpc::Status FakeServer::Download(Context*, const v1::DownloadRequest* request,
                                  grpc::ServerWriter<v1::DownloadChunk>* writer) {
  const std::scoped_lock lock(mutex_);
  download_offsets.push_back(request->offset());
  const auto found = blobs.find(request->digest().sha256());
  if (found == blobs.end()) return {grpc::StatusCode::NOT_FOUND, "no blob " + request->digest().sha256()};
  std::size_t sent = 0;
  for (std::size_t offset = request->offset(); offset < found->second.size(); offset += kChunkBytes) {
    v1::DownloadChunk chunk;
    chunk.set_offset(offset);
    chunk.set_data(found->second.substr(offset, kChunkBytes));
    writer->Write(chunk);
    sent += chunk.data().size();
    if (break_downloads_after > 0 && sent >= break_downloads_after) return kAway;
  }
  return {};
}

grpc::Status FakeServer::SubmitBake(Context* context, const v1::SubmitBakeRequest* request, v1::Bake* response) {
  const std::scoped_lock lock(mutex_);
  request_ids.push_back(request->request_id());
  const grpc::Status status = unary(*context);
  if (!status.ok()) return status;
  response->set_name("bakes/1");
  response->set_label(request->label());
  return submit_status;
}

grpc::Status FakeServer::GetBake(Context* context, const v1::GetBakeRequest* request, v1::Bake* response) {
  const std::scoped_lock lock(mutex_);
  if (request->name() != "bakes/1") return {grpc::StatusCode::NOT_FOUND, "no bake '" + request->name() + "'"};
  *response = finished;
  return unary(*context);
}

grpc::Status FakeServer::FinishBake(Context* context, const v1::FinishBakeRequest* request, v1::Bake* response) {
  const std::scoped_lock lock(mutex_);
  to_finish.push_back(request->name());
  response->set_name(request->name());
  return unary(*context);
}

grpc::Status FakeServer::ListBakes(Context* context, const v1::ListBakesRequest* request,
                                   v1::ListBakesResponse* response) {
  const std::scoped_lock lock(mutex_);
  const int begin = request->page_token().empty() ? 0 : std::stoi(request->page_token());
  const int end = std::min(begin + page_size, num_bakes);
  for (int i = begin; i < end; ++i) response->add_bakes()->set_name("bakes/" + std::to_string(i));
  if (end < num_bakes) response->set_next_page_token(std::to_string(end));
  return unary(*context);
}

grpc::Status FakeServer::WatchBake(Context* context, const v1::WatchBakeRequest* request,
                                   grpc::ServerWriter<v1::WatchBakeResponse>* writer) {
  {
    const std::scoped_lock lock(mutex_);
    watch_sequences.push_back(request->after_sequence());
  }
  v1::WatchBakeResponse response;
  response.mutable_snapshot()->set_name(request->name());
  writer->Write(response);
  if (break_watches_at_snapshot) return kAway;
  while (hold_watches && !context->IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::size_t num_sent = 0;
  for (const v1::BakeEvent& event : events) {
    if (event.sequence() <= request->after_sequence()) continue;
    *response.mutable_event() = event;
    writer->Write(response);
    if (break_watches_after > 0 && ++num_sent >= break_watches_after) return kAway;
  }
  *response.mutable_finished() = finished;
  writer->Write(response);
  return {};
}

}  // namespace radbake::api
