#include "server/service/bake_server.h"

#include <fcntl.h>
#include <grpc/grpc.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>

#include <chrono>
#include <utility>

namespace radbake::service {
namespace {

constexpr int kPoolThreads = 4;
constexpr std::size_t kTransportQuotaBytes = std::size_t{256} << 20;
constexpr int kMaxSendBytes = 4 << 20;
constexpr int kMaxStreamsPerConnection = 200;
constexpr int kKeepaliveMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;
constexpr int kMinPingIntervalMs = 30'000;
constexpr std::chrono::seconds kShutdownGrace{2};
const char* const kServiceNames[] = {"radbake.v1.Content", "radbake.v1.Bakes", "radbake.v1.Server"};

/// The lock lives as long as the descriptor, so a server that was killed leaves none.
Result<store::FileDescriptor> lock_folder(const std::filesystem::path& folder) {
  RADBAKE_RETURN_IF_ERROR(store::make_folders(folder));
  RADBAKE_ASSIGN_OR_RETURN(store::FileDescriptor file, store::open_file(folder / "lock", O_RDWR | O_CREAT));
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorCode::kFailedPrecondition,
                 "the data folder " + folder.string() + " is in use by another radbaked: name another with --data"};
  }
  return file;
}

void set_health(grpc::Server& server, bool is_serving) {
  grpc::HealthCheckServiceInterface* health = server.GetHealthCheckService();
  health->SetServingStatus(is_serving);
  for (const char* name : kServiceNames) health->SetServingStatus(name, is_serving);
}

}  // namespace

Result<std::unique_ptr<BakeServer>> BakeServer::start(BakeServerOptions options) {
  options.queue.max_running = static_cast<std::uint32_t>(options.limits.max_running_bakes);
  options.queue.max_queued = static_cast<std::uint32_t>(options.limits.max_queued_bakes);
  options.queue.spool_folder = options.data / "spool";
  std::unique_ptr<BakeServer> server(new BakeServer());
  RADBAKE_RETURN_IF_ERROR(server->open_stores(options));

  server->queue_ = std::make_unique<jobs::JobQueue>(options.queue, *server->jobs_, *server->content_);
  server->pool_ = std::make_unique<store::TaskPool>(kPoolThreads);
  server->costs_ = std::make_unique<CostFile>(options.costs.empty() ? options.data / "costs.txt" : options.costs);
  server->workers_service_ =
      std::make_unique<WorkersService>(*server->queue_, *server->pool_, *server->costs_, options.limits);
  server->content_service_ = std::make_unique<ContentService>(*server->content_, *server->pool_, options.limits);
  server->bakes_service_ = std::make_unique<BakesService>(*server->queue_, *server->content_, *server->pool_,
                                                          options.limits, options.max_threads);
  server->server_service_ = std::make_unique<ServerService>(options.limits);

  // Listen last: who can connect finds everything ready. Jobs of an earlier server begin to run before that.
  RADBAKE_RETURN_IF_ERROR(server->workers_service_->start());
  RADBAKE_RETURN_IF_ERROR(server->queue_->start(*server->workers_service_));
  RADBAKE_RETURN_IF_ERROR(server->listen(options));
  return server;
}

Result<void> BakeServer::open_stores(const BakeServerOptions& options) {
  RADBAKE_ASSIGN_OR_RETURN(lock_, lock_folder(options.data));
  RADBAKE_ASSIGN_OR_RETURN(content_,
                           store::ContentStore::open(options.data / "content", options.limits.max_blob_bytes));
  RADBAKE_ASSIGN_OR_RETURN(jobs_, store::JobStore::open(options.data / "jobs.sqlite"));
  return {};
}

Result<void> BakeServer::listen(const BakeServerOptions& options) {
  // Never paid back: when the last gRPC object goes, the library stops its threads, and one that polls for a socket's
  // writes may be waited for as long as 10 s.
  grpc_init();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(options.listen, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(content_service_.get());
  builder.RegisterService(bakes_service_.get());
  builder.RegisterService(server_service_.get());
  builder.SetMaxReceiveMessageSize(static_cast<int>(options.limits.max_message_bytes));
  builder.SetMaxSendMessageSize(kMaxSendBytes);
  // gRPC takes memory for all that a compressed message becomes before it looks at the limit on its size.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetResourceQuota(grpc::ResourceQuota("radbaked").Resize(kTransportQuotaBytes));
  // Reflection is the one service with a blocking implementation: two threads are enough for it.
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
  // Otherwise a second server on the same port would quietly take every other connection.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreamsPerConnection);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
  server_ = builder.BuildAndStart();
  if (!server_ || port == 0) {
    return Error{ErrorCode::kUnavailable, "cannot listen on '" + options.listen +
                                              "': not an address of this machine (host:port or unix:PATH), or in use"};
  }
  address_ = options.listen;
  if (!options.listen.starts_with("unix:")) {
    address_ = options.listen.substr(0, options.listen.rfind(':')) + ":" + std::to_string(port);
  }
  set_health(*server_, true);
  return {};
}

BakeServer::~BakeServer() {
  stop();
  // A start that failed half-way may have workers already.
  if (queue_) queue_->drain();
  if (workers_service_) workers_service_->stop();
  // No call is left; the pool's last tasks still use the queue.
  pool_.reset();
}

void BakeServer::stop() {
  if (!server_) return;
  set_health(*server_, false);
  queue_->drain();
  server_->Shutdown(std::chrono::system_clock::now() + kShutdownGrace);
  workers_service_->stop();
}

}  // namespace radbake::service
