#include "server/service/bakes_service.h"

#include <charconv>
#include <utility>

#include "server/service/convert.h"
#include "server/service/plan_reactor.h"
#include "server/service/rpc_watch.h"
#include "server/service/status.h"
#include "server/service/visible_job.h"
#include "server/service/watch_reactor.h"

namespace radbake::service {
namespace {

constexpr std::size_t kMaxRequestIdBytes = 128;
constexpr std::size_t kMaxLabelBytes = 256;
constexpr std::size_t kMaxClientBytes = 128;
constexpr int kMaxPriority = 100;
constexpr std::uint32_t kDefaultPageSize = 100;
constexpr std::uint32_t kMaxPageSize = 1000;

grpc::Status reply(const Result<std::shared_ptr<jobs::Job>>& job, v1::Bake& bake) {
  if (!job.ok()) return busy(job.error(), "max_queued_bakes");
  bake = to_message(**job);
  return grpc::Status::OK;
}

/// Who turns are shared out between: what the caller calls itself, else its connection.
std::string client_of(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  const auto found = metadata.find("radbake-client");
  if (found == metadata.end()) return context.peer();
  return {found->second.data(), std::min(found->second.size(), kMaxClientBytes)};
}

store::JobOwner owner_of(const access::Caller& caller, const grpc::CallbackServerContext& context) {
  return {.tenant = caller.tenant, .client = client_of(context), .trace_id = trace_id_of(context)};
}

void set_place(const jobs::QueuePlace& place, v1::Bake& bake) {
  bake.set_queue_position(place.position);
  bake.set_expected_start_unix_ms(place.expected_start_unix_ms);
  bake.set_shares(place.shares);
}

}  // namespace

grpc::ServerUnaryReactor* BakesService::SubmitBake(grpc::CallbackServerContext* context,
                                                   const v1::SubmitBakeRequest* request, v1::Bake* bake) {
  if (request->validate_only()) return validate(context, *request, *bake);
  return calls_.answer(context, [this, context, request, bake](const access::Caller& caller) {
    return submit(owner_of(caller, *context), *request, *bake);
  });
}

grpc::Status BakesService::submit(const store::JobOwner& owner, const v1::SubmitBakeRequest& request, v1::Bake& bake) {
  store::NewJob job;
  std::shared_ptr<jobs::Job> known;
  job.owner = owner;
  if (auto status = admit(request, job, known); !status.ok()) return status;
  return known ? reply(known, bake) : reply(queue_.submit(job), bake);
}

grpc::ServerUnaryReactor* BakesService::validate(grpc::CallbackServerContext* context,
                                                 const v1::SubmitBakeRequest& request, v1::Bake& bake) {
  auto* reactor = new PlanReactor(queue_, bake.mutable_plan());
  calls_.run(context, reactor, [this, context, &request, &bake, reactor](const access::Caller& caller) {
    store::NewJob job;
    std::shared_ptr<jobs::Job> known;
    job.owner = owner_of(caller, *context);
    const grpc::Status status = admit(request, job, known);
    if (status.ok()) {
      bake.set_label(job.label);
      bake.set_bake_key(job.bake_key);
      *bake.mutable_manifest() = request.manifest();
      *bake.mutable_settings() = request.settings();
    }
    reactor->begin(status, job.owner, job.work);
  });
  return reactor;
}

grpc::Status BakesService::admit(const v1::SubmitBakeRequest& request, store::NewJob& job,
                                 std::shared_ptr<jobs::Job>& known) {
  if (request.request_id().empty() || request.request_id().size() > kMaxRequestIdBytes) {
    return bad_field("request_id", "must have 1 to " + std::to_string(kMaxRequestIdBytes) + " bytes, not " +
                                       std::to_string(request.request_id().size()));
  }
  if (request.label().size() > kMaxLabelBytes) {
    return bad_field("label",
                     std::to_string(request.label().size()) + " bytes are above " + std::to_string(kMaxLabelBytes));
  }
  if (request.priority() < -kMaxPriority || request.priority() > kMaxPriority) {
    return bad_field("priority", std::to_string(request.priority()) + " is not between -100 and 100");
  }
  job.owner.priority = request.priority();
  job.owner.is_shared = !request.no_cache();
  job.request_id = request.request_id();
  job.body_sha256 = digest_of(request.SerializeAsString()).sha256;
  // A request that was accepted once is answered as it was, whatever became of its blobs and of the queue.
  const auto found = queue_.find_request(job.owner.tenant, job.request_id, job.body_sha256);
  if (!found.ok()) return to_status(found.error());
  known = *found;
  if (known) return grpc::Status::OK;
  if (auto room = disk_.admit(); !room.ok() && !request.validate_only()) {
    return to_status(room.error());
  }

  const SceneRequest scene{request.manifest(), request.settings(), request.run()};
  if (auto status = check(scene, job.owner.tenant, job.work); !status.ok()) return status;
  job.label = request.label();
  job.bake_key = make_bake_key(job.work);
  return grpc::Status::OK;
}

grpc::Status BakesService::check(const SceneRequest& scene, const std::string& tenant, store::Work& work) {
  const auto content = content_.of(tenant);
  if (!content.ok()) return to_status(content.error());
  return check_scene(scene, limits_, max_threads_, **content, work);
}

grpc::ServerUnaryReactor* BakesService::PlanBake(grpc::CallbackServerContext* context,
                                                 const v1::PlanBakeRequest* request, v1::Plan* plan) {
  auto* reactor = new PlanReactor(queue_, plan);
  calls_.run(context, reactor, [this, context, request, reactor](const access::Caller& caller) {
    store::Work work;
    const store::JobOwner owner = owner_of(caller, *context);
    const grpc::Status status = check({request->manifest(), request->settings(), request->run()}, owner.tenant, work);
    reactor->begin(status, owner, work);
  });
  return reactor;
}

grpc::ServerUnaryReactor* BakesService::GetBake(grpc::CallbackServerContext* context, const v1::GetBakeRequest* request,
                                                v1::Bake* bake) {
  return calls_.answer(context,
                       [this, request, bake](const access::Caller& caller) { return get(caller, *request, *bake); });
}

grpc::Status BakesService::get(const access::Caller& caller, const v1::GetBakeRequest& request, v1::Bake& bake) {
  const grpc::Status status = reply(find_visible(queue_, caller, request.name()), bake);
  if (status.ok() && bake.state() == v1::QUEUED) set_place(queue_.places()[bake.name()], bake);
  return status;
}

grpc::ServerUnaryReactor* BakesService::CancelBake(grpc::CallbackServerContext* context,
                                                   const v1::CancelBakeRequest* request, v1::Bake* bake) {
  return calls_.answer(context, [this, request, bake](const access::Caller& caller) {
    const auto visible = find_visible(queue_, caller, request->name());
    return reply(visible.ok() ? queue_.cancel(request->name()) : visible, *bake);
  });
}

grpc::ServerUnaryReactor* BakesService::FinishBake(grpc::CallbackServerContext* context,
                                                   const v1::FinishBakeRequest* request, v1::Bake* bake) {
  return calls_.answer(context, [this, request, bake](const access::Caller& caller) {
    const auto visible = find_visible(queue_, caller, request->name());
    return reply(visible.ok() ? queue_.finish(request->name()) : visible, *bake);
  });
}

grpc::ServerUnaryReactor* BakesService::ListBakes(grpc::CallbackServerContext* context,
                                                  const v1::ListBakesRequest* request,
                                                  v1::ListBakesResponse* response) {
  return calls_.answer(
      context, [this, request, response](const access::Caller& caller) { return list(caller, *request, *response); });
}

grpc::Status BakesService::list(const access::Caller& caller, const v1::ListBakesRequest& request,
                                v1::ListBakesResponse& response) {
  if (request.page_size() > kMaxPageSize) {
    return bad_field("page_size", std::to_string(request.page_size()) + " is above " + std::to_string(kMaxPageSize));
  }
  // A page's token is the id of its predecessor's last bake.
  std::int64_t before_id = 0;
  const std::string& token = request.page_token();
  if (!token.empty()) {
    const auto [end, problem] = std::from_chars(token.data(), token.data() + token.size(), before_id);
    if (problem != std::errc() || end != token.data() + token.size() || before_id <= 0) {
      return bad_field("page_token", "'" + token.substr(0, 40) + "' is not a token of this server");
    }
  }
  const std::uint32_t page_size = request.page_size() == 0 ? kDefaultPageSize : request.page_size();
  const auto whose = caller.role == access::Role::kAdmin ? std::nullopt : std::optional(caller.tenant);
  auto records = queue_.list(whose, page_size + 1, before_id);
  if (!records.ok()) return to_status(records.error());
  if (records->size() > page_size) {
    records->pop_back();
    response.set_next_page_token(std::to_string(records->back().id));
  }
  const std::map<std::string, jobs::QueuePlace> places = queue_.places();
  for (const store::JobRecord& record : *records) {
    v1::Bake& bake = *response.add_bakes();
    bake = to_message(record, queue_.progress_of(record.name));
    if (const auto place = places.find(record.name); place != places.end()) set_place(place->second, bake);
  }
  return grpc::Status::OK;
}

grpc::ServerWriteReactor<v1::WatchBakeResponse>* BakesService::WatchBake(grpc::CallbackServerContext* context,
                                                                         const v1::WatchBakeRequest* request) {
  Admission admission = gate_.admit(*context);
  auto slot = watches_->take(admission);
  return WatchReactor::start(admission, std::move(slot), queue_, pool_, *request);
}

}  // namespace radbake::service
