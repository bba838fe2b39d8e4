#include <future>
#include <optional>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/predictions.h"
#include "client/cli/reached_error.h"
#include "client/cli/requests.h"
#include "client/cli/results.h"
#include "client/cli/scene_file.h"
#include "client/cli/send_scene.h"
#include "client/image/image_codec.h"
#include "client/options/target_options.h"

namespace radbake::cli {
namespace {

/// Follows the bake to its end. A first Ctrl-C asks for the best so far and goes on waiting, a second one cancels and
/// goes on waiting, a third one gives up.
Result<v1::Bake> follow(const CommandContext& context, api::Client& client, const std::string& name) {
  const Interrupt& interrupt = context.interrupt;
  std::uint64_t sequence = 0;
  const auto watch = [&](std::stop_token stop) {
    return client.watch(
        name, {sequence, false},
        [&](const v1::WatchBakeResponse& response) {
          if (response.has_event()) sequence = response.event().sequence();
          context.reporter.watched(response);
        },
        stop);
  };
  const auto is_interrupted = [](const Result<v1::Bake>& bake, std::stop_token stop) {
    return !bake.ok() && bake.error().code == ErrorCode::kCancelled && stop.stop_requested();
  };

  Result<v1::Bake> bake = watch(interrupt.once());
  if (is_interrupted(bake, interrupt.once()) && !interrupt.twice().stop_requested()) {
    context.reporter.note("ending " + name + " with the best so far (Ctrl-C again: cancel)");
    bake = client.finish(name, interrupt.twice());
    if (bake.ok()) bake = watch(interrupt.twice());
  }
  if (is_interrupted(bake, interrupt.twice())) {
    context.reporter.note("cancelling " + name + " (Ctrl-C again: do not wait)");
    bake = client.cancel(name, interrupt.thrice());
    if (bake.ok()) bake = watch(interrupt.thrice());
  }
  return bake;
}

/// Says what error was reached, as a warning where it is not what was wanted. False: an error that was asked for was
/// not reached.
bool tell_error(const CommandContext& context, const v1::BakeReport& report) {
  const bool is_reached = options::asked_error(context.line.bake) == 0 || report.error().reached();
  const std::string line = report.has_error() ? reached_line(report.error()) : "the server tells no error";
  if (!is_reached) {
    context.reporter.warning({"error_not_reached", line});
  } else if (report.error().limited_by() == "stopped") {
    context.reporter.warning({"ended_early", line});
  } else if (report.has_error()) {
    context.reporter.note(line);
  }
  return is_reached;
}

/// Ends a command whose bake others will ask for.
ExitCode leave(const CommandContext& context, const v1::Bake& bake) {
  const bool has_ended = bake.state() >= v1::SUCCEEDED;
  if (has_ended && bake.state() != v1::SUCCEEDED) return fail_with(context, bake);
  context.reporter.note(bake.name() + (has_ended ? " has its result" : " goes on without us") +
                        "; get it with radbake download " + bake.name() + " -o DIR");
  return kDone;
}

}  // namespace

ExitCode run_submit(const CommandContext& context) {
  if (context.line.dry_run) return run_plan(context);
  const CommandLine& line = context.line;
  std::optional<ResultFolder> folder;
  if (!line.detach) {
    Result<ResultFolder> opened = ResultFolder::open(line.folder, line.force);
    if (!opened.ok()) return fail(context, opened.error(), kUsage);
    folder.emplace(std::move(opened).value());
  }
  Stopwatch stages;
  context.reporter.stage("connecting", -1);
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  stages.end_stage("connect");
  const Result<void> within_limits = check_limits(line.bake, session->client.capabilities().limits());
  if (!within_limits.ok()) return fail(context, within_limits.error(), kUsage);

  // Load the image library aside: it costs 0.3 s of one core, and results are to be written as soon as they are there.
  std::future<Result<const image::ImageCodec*>> loading;
  if (!line.detach) loading = std::async(std::launch::async, [] { return image::load_image_codec(); });

  Result<ReadScene> read = read_and_encode(context, stages);
  if (!read.ok()) return fail(context, read.error());
  std::optional<BakedScene> scene;
  if (!line.detach) {
    Result<BakedScene> kept = keep_for_writing(line.scene, std::move(read->scene), read->encoded);
    if (!kept.ok()) return fail(context, kept.error());
    scene = std::move(kept).value();
  }
  const Result<void> uploaded = upload(context, session->client, read->encoded, stages);
  if (!uploaded.ok()) return fail(context, session->explain(uploaded.error()));
  // Without the stop token: a submit that was sent and not answered would leave a bake that nobody can name.
  Result<v1::Bake> bake = session->client.submit(submit_request(line, read->encoded.manifest));
  if (!bake.ok()) return fail(context, session->explain(bake.error()));
  context.reporter.submitted(*bake);
  const std::string name = bake->name();
  if (bake->from_store()) {
    context.reporter.note("the server has baked this before: its result is the answer (--no-cache: bake again)");
  }
  if (line.detach) return leave(context, *bake);
  // Not after the bake: hours of work would be out of reach, on a private server for ever.
  if (const Result<const image::ImageCodec*> images = loading.get(); !images.ok()) {
    Error error = images.error();
    if (!line.server.empty()) error.message += "; " + name + " goes on: see radbake download " + name;
    return fail(context, error);
  }
  read->encoded.blobs.clear();  // what the server has needs no place here for the hours of a bake

  bake = follow(context, session->client, name);
  if (!bake.ok()) {
    Error error = session->explain(bake.error());
    if (!line.server.empty()) error.message += "; " + name + " may go on: see radbake watch " + name;
    return fail(context, error);
  }
  stages.end_stage("bake");
  if (bake->state() != v1::SUCCEEDED) return fail_with(context, *bake);

  const bool is_reached = tell_error(context, bake->result().report());
  const std::optional<SceneReport> report = std::move(read->report);
  const Result<void> written = write_results(session->client, {*bake, report, scene, line.files}, *folder, stages,
                                             context.reporter, context.interrupt.twice());
  if (!written.ok()) return fail(context, session->explain(written.error()));
  context.reporter.note(prediction_line(bake->result().report().run()));
  return is_reached || !line.strict ? kDone : kTargetMissed;
}

}  // namespace radbake::cli
