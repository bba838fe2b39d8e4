#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "common/base/limits.h"
#include "common/base/result.h"
#include "server/access/access_options.h"
#include "server/access/listener.h"
#include "server/jobs/housekeeping.h"
#include "server/jobs/job_queue.h"
#include "server/service/admin_server.h"
#include "server/service/bakes_service.h"
#include "server/service/content_service.h"
#include "server/service/disk_watch.h"
#include "server/service/gate.h"
#include "server/service/metrics.h"
#include "server/service/readiness.h"
#include "server/service/server_service.h"
#include "server/service/unary_calls.h"
#include "server/service/workers_service.h"
#include "server/store/job_store.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

struct BakeServerOptions {
  std::string listen = "127.0.0.1:7419";  ///< host:port (0: any) or unix:PATH
  std::filesystem::path data;             ///< everything that must survive lives here; one server at a time
  std::filesystem::path costs;            ///< what bakes cost on this host; empty: in the data folder
  access::AccessOptions access;           ///< who may call
  jobs::HousekeepingOptions housekeeping;
  jobs::QueueOptions queue;  ///< its max_* and spool folder are set from here
  Limits limits;
  std::uint32_t max_threads = 0;             ///< of a bake; 0: no bound
  std::string admin_listen;                  ///< host:port (0: any) for /metrics, /livez and /readyz; empty: none
  std::chrono::milliseconds drain_grace{0};  ///< bakes that will be done by then may end when the server stops
  DiskWatchOptions disk;                     ///< its folder and floor are set from here
};

/// The whole server: stores, queue and services, listening. start() ... stop(), once.
///
/// What outside can see of it, in order: /livez; the address, with health NOT_SERVING and bakes UNAVAILABLE while it
/// takes up what an earlier server left; SERVING, unless the disk is full; NOT_SERVING from stop() on.
class BakeServer {
 public:
  /// Errors: kFailedPrecondition for a data folder in use, kUnavailable for an address that cannot be listened on,
  /// kInvalidArgument for an address that others can reach without proof of who they are.
  static Result<std::unique_ptr<BakeServer>> start(BakeServerOptions options);
  /// Stops.
  ~BakeServer();

  /// Where clients find it, with the port that was chosen.
  const std::string& address() const { return listener_->address(); }
  /// Where the admin port is; empty: there is none.
  std::string admin_address() const { return admin_ ? admin_->address() : ""; }

  /// Refuses new work, lets bakes end that will be done within the grace, queues the others for the next start, ends
  /// watches, and waits for calls to end.
  void stop();

 private:
  explicit BakeServer(BakeServerOptions options) : options_(std::move(options)) {}
  Result<void> run(const access::ListenAddress& where);
  Result<void> start_admin();
  Result<void> open_stores();
  void make_services();
  Result<void> listen(const access::ListenAddress& where);
  std::string metrics_page();

  const BakeServerOptions options_;
  Metrics metrics_;
  Readiness readiness_;

  store::FileDescriptor lock_;
  std::unique_ptr<store::TenantContent> content_;
  std::unique_ptr<store::JobStore> jobs_;
  std::unique_ptr<jobs::Housekeeping> housekeeping_;
  std::unique_ptr<jobs::JobQueue> queue_;
  std::unique_ptr<store::TaskPool> pool_;
  std::unique_ptr<CostFile> costs_;
  std::unique_ptr<Gate> gate_;
  std::unique_ptr<UnaryCalls> calls_;
  std::unique_ptr<WorkersService> workers_service_;
  std::unique_ptr<ContentService> content_service_;
  std::unique_ptr<BakesService> bakes_service_;
  std::unique_ptr<ServerService> server_service_;
  std::unique_ptr<DiskWatch> disk_;
  std::shared_ptr<grpc::ServerCredentials> credentials_;  // used at each handshake: outlives the server
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<access::Listener> listener_;
  std::atomic<bool> has_parts_ = false;  // what metrics_page() reads is there
  std::unique_ptr<AdminServer> admin_;   // last: its pages read the others
};

}  // namespace radbake::service
