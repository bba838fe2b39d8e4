#include "server/worker/run_worker.h"

#include <grpc/grpc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <span>
#include <thread>
#include <utility>

#include "common/base/digest.h"
#include "common/base/limits.h"
#include "common/base/shortened.h"
#include "common/base/version.h"
#include "common/codec/scene_codec.h"
#include "common/log/log.h"
#include "server/settings/to_options.h"
#include "server/worker/input_blobs.h"
#include "server/worker/memory_limit.h"
#include "server/worker/report_stream.h"
#include "server/worker/result_messages.h"
#include "server/worker/send_blob.h"
#include "server/worker/status_message.h"
#include "server/worker/stream_checkpoints.h"

namespace radbake::worker {
namespace {

using Clock = std::chrono::steady_clock;

/// Of a bake: what is done when its result is written.
constexpr double kWritingFraction = 0.95;
/// A budget that has gone by is still one: 0 would be none.
constexpr double kLeastBudgetSeconds = 1e-3;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Passes on what a bake tells.
class StreamObserver : public radiosity::BakeObserver {
 public:
  explicit StreamObserver(ReportStream& stream) : stream_(stream) {}

  void on_progress(const radiosity::BakeProgress& progress) override {
    latest_ = to_message(progress);
    stream_.set_progress(latest_);
  }
  void on_tile(const radiosity::Tile& tile) override {
    v1::WorkerReport report;
    *report.mutable_tile() = to_message(tile);
    stream_.send(std::move(report));  // a server that is gone stops the bake by its token
  }
  /// The last progress of the bake; read it when the bake has returned.
  const v1::Progress& latest() const { return latest_; }

 private:
  ReportStream& stream_;
  v1::Progress latest_;
};

/// Decodes the scene of an order.
Result<Scene> read_scene(const v1::StartWork& start, const InputBlobs& inputs) {
  const Digest manifest{start.manifest().sha256(), start.manifest().size_bytes()};
  if (manifest.size_bytes > start.limits().max_manifest_bytes()) {
    return Error{ErrorCode::kResourceExhausted, "the scene manifest has " + std::to_string(manifest.size_bytes) +
                                                    " bytes; max_manifest_bytes is " +
                                                    std::to_string(start.limits().max_manifest_bytes())};
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::string bytes, inputs.read(manifest));
  return decode_scene(
      bytes, [&](const Digest& digest) { return inputs.read(digest); }, start.limits());
}

std::uint64_t chunk_bytes_of(const v1::Limits& limits) {
  return limits.chunk_bytes() > 0 ? limits.chunk_bytes() : Limits{}.chunk_bytes;
}

/// Sends all layers and the meshes' data, under the state WRITING.
Result<v1::BakeResult> send_result(const radiosity::BakeOutcome& outcome, v1::Progress progress,
                                   std::uint64_t chunk_bytes, ReportStream& stream) {
  v1::BakeResult result;
  std::string mesh_data;
  for (const radiosity::MeshOutput& mesh : outcome.meshes) *result.add_meshes() = to_message(mesh, mesh_data);

  std::uint64_t total = mesh_data.size(), sent = 0;
  for (const radiosity::Layer& layer : outcome.layers) total += layer.values.size() * sizeof(float);
  const double begun_at = std::max(progress.fraction(), kWritingFraction);
  const auto report_sent = [&](std::uint64_t bytes) {
    sent += bytes;
    progress.set_state(v1::WRITING);
    // A bake that reached what was asked may have been expected to take longer.
    progress.set_fraction(begun_at + (1 - begun_at) * static_cast<double>(sent) /
                                         static_cast<double>(std::max<std::uint64_t>(total, 1)));
    progress.set_seconds_left(-1);
    progress.set_steps_done(sent);
    progress.set_steps_total(total);
    stream.set_progress(progress);
  };
  report_sent(0);
  for (const radiosity::Layer& layer : outcome.layers) {
    v1::Layer& message = *result.add_layers();
    message = to_message(layer);
    RADBAKE_ASSIGN_OR_RETURN(*message.mutable_blob(),
                             send_blob(layer.name, BlobUse::kResult, std::as_bytes(std::span(layer.values)),
                                       chunk_bytes, stream, report_sent));
  }
  if (!mesh_data.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(*result.mutable_mesh_data(),
                             send_blob("mesh_data", BlobUse::kResult, std::as_bytes(std::span(mesh_data)), chunk_bytes,
                                       stream, report_sent));
  }
  return result;
}

radiosity::BakeOptions options_of(const v1::StartWork& start) {
  radiosity::BakeOptions options = settings::to_options(start.settings(), start.run());
  options.costs = settings::to_costs(start.costs());
  return options;
}

Result<v1::WorkerReport> plan(const v1::StartWork& start, const InputBlobs& inputs, ReportStream& stream) {
  RADBAKE_ASSIGN_OR_RETURN(const Scene scene, read_scene(start, inputs));
  RADBAKE_ASSIGN_OR_RETURN(const radiosity::PlannedBake planned,
                           radiosity::plan_scene(scene, options_of(start), stream.stop_token()));
  v1::WorkerReport report;
  *report.mutable_plan_finished() = to_message(planned.plan);
  *report.mutable_plan_finished()->mutable_prediction() = to_message(planned.prediction);
  return report;
}

Result<v1::WorkerReport> bake(const v1::StartWork& start, const WorkerIdentity& identity, const InputBlobs& inputs,
                              ReportStream& stream) {
  const auto began_at = Clock::now();
  StageClock before, after;
  before.begin("decoding");
  RADBAKE_ASSIGN_OR_RETURN(const Scene scene, read_scene(start, inputs));
  before.end();

  radiosity::BakeOptions options = options_of(start);
  if (options.time_budget_seconds > 0) {
    // What has gone since the bake was accepted, this process's start and the decoding among it, is not there any more.
    options.time_budget_seconds =
        std::max(kLeastBudgetSeconds, options.time_budget_seconds - start.waited_seconds() - seconds_since(began_at));
  }
  StreamObserver observer(stream);
  StreamCheckpoints checkpoints(start, inputs, chunk_bytes_of(start.limits()), stream);
  const auto bake_began_at = Clock::now();
  RADBAKE_ASSIGN_OR_RETURN(
      const radiosity::BakeOutcome outcome,
      radiosity::bake_scene(scene, options, observer, stream.stop_token(), stream.finish_token(), &checkpoints));
  const double bake_seconds = seconds_since(bake_began_at);

  after.begin("writing");
  RADBAKE_ASSIGN_OR_RETURN(v1::BakeResult result,
                           send_result(outcome, observer.latest(), chunk_bytes_of(start.limits()), stream));
  after.end();

  // Complete the report with what the library does not know.
  std::vector<radiosity::StageTime> stages = before.stages();
  stages.insert(stages.end(), outcome.report.stages.begin(), outcome.report.stages.end());
  stages.insert(stages.end(), after.stages().begin(), after.stages().end());
  const auto threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  v1::BakeReport& report = *result.mutable_report();
  report = to_message(outcome.report);
  report.set_engine_version(kEngineVersion);
  *report.mutable_run() = run_report(identity, stages, seconds_since(began_at), static_cast<std::uint32_t>(threads));
  // What is baked towards a target is planned pass by pass, and not predicted as a whole.
  if (outcome.report.prediction.total.cpu_seconds > 0) {
    *report.mutable_run()->mutable_prediction() = to_message(outcome.report.prediction);
  }
  *report.mutable_run()->mutable_costs() = to_message(outcome.report.costs);
  const std::uint64_t num_rays = report.num_row_rays() + report.num_gather_rays() + report.num_light_rays();
  for (const radiosity::PassSummary& pass : outcome.report.passes) {
    v1::PassSeconds& seconds = *report.mutable_run()->add_passes();
    seconds.set_seconds(pass.seconds);
    seconds.set_cpu_seconds(pass.cpu_seconds);
  }
  report.mutable_run()->set_rays_per_second(static_cast<double>(num_rays) / bake_seconds);
  v1::WorkerReport finished;
  *finished.mutable_bake_finished() = std::move(result);
  return finished;
}

/// Does the work; nothing that it throws gets further.
Result<v1::WorkerReport> work(const v1::StartWork& start, const WorkerIdentity& identity, ReportStream& stream) {
  try {
    const InputBlobs inputs(start, identity.inputs);
    return start.plan_only() ? plan(start, inputs, stream) : bake(start, identity, inputs, stream);
  } catch (const std::exception& exception) {
    if (is_lack_of_memory(exception)) return out_of_memory();
    return internal_error(std::string("the worker failed: ") + exception.what());
  }
}

}  // namespace

int run_worker(const std::shared_ptr<grpc::Channel>& channel, const WorkerIdentity& identity) {
  // Never paid back: when the last gRPC object goes, the library stops its threads, and one that polls for a socket's
  // writes may be waited for as long as 10 s.
  grpc_init();
  v1::WorkerHello hello;
  hello.set_job(identity.job);
  hello.set_attempt(identity.attempt);
  hello.set_engine_version(kEngineVersion);
  hello.set_protocol_major(kProtocolMajor);
  ReportStream stream(channel, hello);
  const auto start = stream.wait_for_start();
  if (!start) {
    spdlog::error("{} attempt {}: the server ended the connection before it sent work", identity.job, identity.attempt);
    return kExitServerGone;
  }

  set_program_trace(start->trace_id());
  auto done = work(*start, identity, stream);
  v1::WorkerReport outcome;
  if (done.ok()) {
    outcome = std::move(done).value();
  } else if (done.error().code == ErrorCode::kCancelled) {
    *outcome.mutable_cancelled() = to_message(done.error());
  } else {
    spdlog::warn("{} attempt {} failed: {}", identity.job, identity.attempt, shortened(done.error().message));
    *outcome.mutable_failed() = to_message(done.error());
  }
  if (!stream.finish(std::move(outcome))) {
    spdlog::error("{} attempt {}: the server went before it had stored the outcome", identity.job, identity.attempt);
    return kExitServerGone;
  }
  return kExitDone;
}

}  // namespace radbake::worker
