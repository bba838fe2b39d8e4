#include "server/service/bake_server.h"

#include <fcntl.h>
#include <grpc/grpc.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>

#include <chrono>
#include <utility>
#include <vector>

#include "server/service/rpc_watch.h"
#include "server/service/tls_credentials.h"

namespace radbake::service {
namespace {

constexpr int kPoolThreads = 4;
constexpr std::size_t kTransportQuotaBytes = std::size_t{256} << 20;
constexpr int kMaxSendBytes = 4 << 20;
constexpr int kKeepaliveMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;
constexpr int kMinPingIntervalMs = 30'000;
constexpr int kHandshakeLimitMs = 20'000;
// Of connections from elsewhere: one without calls is closed, and none stays for ever, so that a client's certificate
// is looked at again. Clients connect anew by themselves, and resume watches and transfers.
constexpr int kMaxIdleMs = 10 * 60'000;
constexpr int kMaxAgeMs = 60 * 60'000;
constexpr int kAgeGraceMs = 5 * 60'000;
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

/// What gRPC logs, as lines of our own log. Most of it is what peers do wrong: no error of this server.
void log_of_grpc(gpr_log_func_args* line) { spdlog::warn("gRPC: {}", line->message); }

void set_health(grpc::Server& server, bool is_serving) {
  grpc::HealthCheckServiceInterface* health = server.GetHealthCheckService();
  health->SetServingStatus(is_serving);
  for (const char* name : kServiceNames) health->SetServingStatus(name, is_serving);
}

}  // namespace

Result<std::unique_ptr<BakeServer>> BakeServer::start(BakeServerOptions options) {
  options.queue.max_running = static_cast<std::uint32_t>(options.limits.max_running_bakes);
  options.queue.max_queued = static_cast<std::uint32_t>(options.limits.max_queued_bakes);
  options.queue.max_running_plans = static_cast<std::uint32_t>(options.limits.max_running_plans);
  options.queue.spool_folder = options.data / "spool";
  options.disk.folder = options.data;
  options.disk.min_free_bytes = options.limits.min_free_disk_bytes;
  // What the options say wrongly shows before anything is touched.
  RADBAKE_ASSIGN_OR_RETURN(const access::ListenAddress where, access::resolve_listen_address(options.listen));
  RADBAKE_RETURN_IF_ERROR(access::check_access(options.access, options.listen, where.is_local));
  std::unique_ptr<BakeServer> server(new BakeServer(std::move(options)));
  RADBAKE_RETURN_IF_ERROR(server->run(where));
  return server;
}

Result<void> BakeServer::run(const access::ListenAddress& where) {
  RADBAKE_ASSIGN_OR_RETURN(gate_, Gate::open(options_.access));
  RADBAKE_ASSIGN_OR_RETURN(lock_, lock_folder(options_.data));
  RADBAKE_RETURN_IF_ERROR(start_admin());
  RADBAKE_RETURN_IF_ERROR(open_stores());
  make_services();
  RADBAKE_RETURN_IF_ERROR(workers_service_->start());
  // Listen before jobs of an earlier server are taken up: an address in use must not cost them an attempt, and who asks
  // meanwhile is told to come again. Health says NOT_SERVING until then.
  RADBAKE_RETURN_IF_ERROR(listen(where));
  RADBAKE_RETURN_IF_ERROR(queue_->start(*workers_service_));
  readiness_.clear(Obstacle::kRecovering);
  return {};
}

Result<void> BakeServer::start_admin() {
  if (options_.admin_listen.empty()) return {};
  AdminPages pages{[this] { return metrics_page(); }, [this] { return readiness_.why_not(); }};
  RADBAKE_ASSIGN_OR_RETURN(admin_, AdminServer::start(options_.admin_listen, std::move(pages)));
  spdlog::info("the admin port is {}", admin_->address());
  return {};
}

Result<void> BakeServer::open_stores() {
  RADBAKE_ASSIGN_OR_RETURN(
      content_, store::TenantContent::open(options_.data / "content",
                                           {options_.limits.max_blob_bytes, options_.limits.max_content_bytes}));
  RADBAKE_ASSIGN_OR_RETURN(jobs_, store::JobStore::open(options_.data / "jobs.sqlite"));
  jobs::HousekeepingOptions housekeeping = options_.housekeeping;
  housekeeping.lacking_bytes = [folder = options_.data, floor = options_.limits.min_free_disk_bytes] {
    const auto free = free_disk_bytes(folder);
    // Half as much more, so that it does not begin again at once.
    return free.ok() && *free < floor ? floor + floor / 2 - *free : std::uint64_t{0};
  };
  housekeeping_ = std::make_unique<jobs::Housekeeping>(housekeeping, *jobs_, *content_);
  return {};
}

void BakeServer::make_services() {
  const Limits& limits = options_.limits;
  jobs::QueueOptions queue_options = options_.queue;
  queue_options.observer = &metrics_;
  queue_ = std::make_unique<jobs::JobQueue>(std::move(queue_options), *jobs_, *content_);
  pool_ = std::make_unique<store::TaskPool>(kPoolThreads);
  costs_ = std::make_unique<CostFile>(options_.costs.empty() ? options_.data / "costs.txt" : options_.costs);
  DiskWatchOptions disk = options_.disk;
  disk.problem = [queue = queue_.get()] { return queue->standstill(); };
  disk_ = std::make_unique<DiskWatch>(std::move(disk), readiness_);
  workers_service_ = std::make_unique<WorkersService>(*queue_, *costs_, metrics_, limits);
  calls_ = std::make_unique<UnaryCalls>(*gate_, *pool_);
  content_service_ = std::make_unique<ContentService>(*gate_, *calls_, *content_, *pool_, *disk_, limits);
  bakes_service_ =
      std::make_unique<BakesService>(*gate_, *calls_, *queue_, *content_, *pool_, *disk_, limits, options_.max_threads);
  server_service_ = std::make_unique<ServerService>(*calls_, limits);
  has_parts_ = true;
}

std::string BakeServer::metrics_page() {
  MetricsSnapshot snapshot;
  snapshot.max_queued_bakes = options_.limits.max_queued_bakes;
  snapshot.max_running_bakes = options_.limits.max_running_bakes;
  snapshot.min_free_disk_bytes = options_.limits.min_free_disk_bytes;
  if (has_parts_) {
    snapshot.queue = queue_->stats();
    content_->for_each([&](const std::string&, const store::ContentStore& content) {
      snapshot.upload_bytes += content.upload_bytes();
      snapshot.content_bytes += content.used_bytes();
    });
    snapshot.free_disk_bytes = disk_->free_bytes();
  }
  return metrics_.render(snapshot, readiness_);
}

Result<void> BakeServer::listen(const access::ListenAddress& where) {
  // Never paid back: when the last gRPC object goes, the library stops its threads, and one that polls for a socket's
  // writes may be waited for as long as 10 s.
  grpc_init();
  gpr_set_log_function(&log_of_grpc);
  grpc::EnableDefaultHealthCheckService(true);
  // It asks nobody who he is: only for this machine.
  if (where.is_local) grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  RADBAKE_ASSIGN_OR_RETURN(credentials_, make_credentials(options_.access));
  grpc::ServerBuilder builder;
  using Connections = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(Connections::FROM_FD, credentials_);
  builder.RegisterService(content_service_.get());
  builder.RegisterService(bakes_service_.get());
  builder.RegisterService(server_service_.get());
  builder.SetMaxReceiveMessageSize(static_cast<int>(options_.limits.max_message_bytes));
  builder.SetMaxSendMessageSize(kMaxSendBytes);
  // gRPC takes memory for all that a compressed message becomes before it looks at the limit on its size.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetResourceQuota(grpc::ResourceQuota("radbaked").Resize(kTransportQuotaBytes));
  // Reflection is the one service with a blocking implementation: two threads are enough for it.
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(options_.limits.max_calls_per_connection));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeLimitMs);
  if (!where.is_local) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdleMs);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, kMaxAgeMs);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, kAgeGraceMs);
  }
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<RpcWatch>(metrics_));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  server_ = builder.BuildAndStart();
  if (!server_) return internal_error("gRPC does not start a server");
  readiness_.listen([this](bool is_ready) { set_health(*server_, is_ready); });
  RADBAKE_ASSIGN_OR_RETURN(access::Listening listening, access::listen_on(where));
  listener_ = std::make_unique<access::Listener>(
      std::move(listening), options_.limits.max_connections, [this](store::FileDescriptor connection) {
        grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
        parameters.fd = connection.release();
        acceptor_->HandleNewConnection(&parameters);
      });
  return {};
}

BakeServer::~BakeServer() {
  stop();
  admin_.reset();
  // A start that failed half-way may have workers already.
  if (queue_) queue_->drain();
  if (workers_service_) workers_service_->stop();
  readiness_.listen(nullptr);
  // No call is left; the pool's last tasks still use the queue.
  pool_.reset();
}

void BakeServer::stop() {
  if (!server_) return;
  queue_->refuse_new();
  readiness_.set(Obstacle::kDraining, "the server is stopping");
  queue_->let_finish(options_.drain_grace);
  queue_->drain();
  if (listener_) listener_->stop();
  server_->Shutdown(std::chrono::system_clock::now() + kShutdownGrace);
  workers_service_->stop();
}

}  // namespace radbake::service
