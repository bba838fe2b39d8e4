#pragma once

#include "common/base/limits.h"
#include "radbake/v1/bake.grpc.pb.h"
#include "server/jobs/job_queue.h"
#include "server/service/call_slots.h"
#include "server/service/disk_watch.h"
#include "server/service/gate.h"
#include "server/service/scene_check.h"
#include "server/service/unary_calls.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::service {

/// radbake.v1.Bakes over the job queue. Everything that may wait for the disk runs on the pool.
class BakesService : public v1::Bakes::CallbackService {
 public:
  /// max_threads: of a bake; 0: as many as it asks for.
  BakesService(const Gate& gate, UnaryCalls& calls, jobs::JobQueue& queue, store::TenantContent& content,
               store::TaskPool& pool, const DiskWatch& disk, const Limits& limits, std::uint32_t max_threads)
      : gate_(gate),
        calls_(calls),
        queue_(queue),
        content_(content),
        pool_(pool),
        disk_(disk),
        limits_(limits),
        max_threads_(max_threads),
        watches_(CallSlots::make("max_watches", limits.max_watches, limits.max_watches_per_tenant)) {}

  grpc::ServerUnaryReactor* SubmitBake(grpc::CallbackServerContext* context, const v1::SubmitBakeRequest* request,
                                       v1::Bake* bake) override;
  grpc::ServerUnaryReactor* PlanBake(grpc::CallbackServerContext* context, const v1::PlanBakeRequest* request,
                                     v1::Plan* plan) override;
  grpc::ServerUnaryReactor* GetBake(grpc::CallbackServerContext* context, const v1::GetBakeRequest* request,
                                    v1::Bake* bake) override;
  grpc::ServerUnaryReactor* ListBakes(grpc::CallbackServerContext* context, const v1::ListBakesRequest* request,
                                      v1::ListBakesResponse* response) override;
  grpc::ServerUnaryReactor* CancelBake(grpc::CallbackServerContext* context, const v1::CancelBakeRequest* request,
                                       v1::Bake* bake) override;
  grpc::ServerUnaryReactor* FinishBake(grpc::CallbackServerContext* context, const v1::FinishBakeRequest* request,
                                       v1::Bake* bake) override;
  grpc::ServerWriteReactor<v1::WatchBakeResponse>* WatchBake(grpc::CallbackServerContext* context,
                                                             const v1::WatchBakeRequest* request) override;

 private:
  grpc::Status submit(const store::JobOwner& owner, const v1::SubmitBakeRequest& request, v1::Bake& bake);
  /// Checks a submit as far as nothing is queued. job: its owner is known. known: the bake that the same request
  /// created before; then the rest of the job is not filled in.
  grpc::Status admit(const v1::SubmitBakeRequest& request, store::NewJob& job, std::shared_ptr<jobs::Job>& known);
  grpc::ServerUnaryReactor* validate(grpc::CallbackServerContext* context, const v1::SubmitBakeRequest& request,
                                     v1::Bake& bake);
  /// As check_scene(), with the blobs of a tenant.
  grpc::Status check(const SceneRequest& scene, const std::string& tenant, store::Work& work);
  grpc::Status get(const access::Caller& caller, const v1::GetBakeRequest& request, v1::Bake& bake);
  grpc::Status list(const access::Caller& caller, const v1::ListBakesRequest& request, v1::ListBakesResponse& response);

  const Gate& gate_;
  UnaryCalls& calls_;
  jobs::JobQueue& queue_;
  store::TenantContent& content_;
  store::TaskPool& pool_;
  const DiskWatch& disk_;
  const Limits limits_;
  const std::uint32_t max_threads_;
  const std::shared_ptr<CallSlots> watches_;
};

}  // namespace radbake::service
