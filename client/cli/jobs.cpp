#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/proto_json.h"
#include "client/cli/results.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

/// "2026-11-22 07:30", local time.
std::string format_time(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm local{};
  localtime_r(&seconds, &local);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M", &local);
  return text;
}

/// Where a bake stands that waits: "next, at about 07:30".
std::string place_of(const v1::Bake& bake) {
  std::string text = bake.shares().empty() ? "" : "shares " + bake.shares();
  if (bake.queue_position() > 0) text = "number " + std::to_string(bake.queue_position());
  if (bake.expected_start_unix_ms() > 0) {
    text += (text.empty() ? "" : ", ") + ("starts at about " + format_time(bake.expected_start_unix_ms()));
  }
  return text.empty() ? "" : " (" + text + ")";
}

std::string describe(const v1::Bake& bake) {
  std::string state = stage_name(bake.state());
  if (bake.state() > v1::QUEUED && bake.state() < v1::SUCCEEDED) {
    state += " " + std::to_string(static_cast<int>(bake.progress().fraction() * 100)) + " %";
  }
  state.resize(std::max<std::size_t>(state.size(), 18), ' ');
  return bake.name() + "  " + format_time(bake.created_unix_ms()) + "  " + state + "  " + bake.label() +
         place_of(bake) + (bake.from_store() ? " (from the store)" : "") + "\n";
}

std::string joined(const google::protobuf::RepeatedPtrField<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string describe(const v1::Capabilities& server) {
  std::string text = "engine version  " + server.engine_version() + "\nprotocol        " +
                     std::to_string(server.protocol_major()) + "." + std::to_string(server.protocol_minor()) +
                     "\ncores           " + std::to_string(server.cores()) + "\noutputs         " +
                     joined(server.outputs()) + "\nlights          " + joined(server.lights()) + "\nestimators      " +
                     joined(server.estimators()) + "\ntransports      " + joined(server.transports()) +
                     "\nsolvers         " + joined(server.solvers()) + "\nlimits\n";
  const Json limits = to_json(server.limits());
  for (const auto& [name, value] : limits.items()) {
    char line[80];
    std::snprintf(line, sizeof line, "  %-22s %14s\n", name.c_str(), value.dump().c_str());
    text += line;
  }
  return text;
}

}  // namespace

ExitCode run_list(const CommandContext& context) {
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  const Result<std::vector<v1::Bake>> bakes = session->client.list(context.interrupt.once());
  if (!bakes.ok()) return fail(context, bakes.error());
  std::string text;
  Json list = Json::array();
  for (const v1::Bake& bake : *bakes) {
    text += describe(bake);
    list.push_back(to_json(bake));
  }
  if (text.empty()) context.reporter.note("no bakes yet");
  context.reporter.answer(text, {{"bakes", std::move(list)}});
  return kDone;
}

ExitCode run_watch(const CommandContext& context) {
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  const std::string& name = context.line.job;
  const std::stop_token stop = context.interrupt.once();
  const Result<v1::Bake> bake = session->client.watch(
      name, {}, [&](const v1::WatchBakeResponse& response) { context.reporter.watched(response); }, stop);
  if (!bake.ok()) {
    if (!stop.stop_requested()) return fail(context, bake.error());
    context.reporter.note("left " + name + "; it goes on");
    return kLeft;
  }
  if (bake->state() != v1::SUCCEEDED) return fail_with(context, *bake);
  context.reporter.note(name + " succeeded; get it with radbake download " + name + " -o DIR");
  return kDone;
}

ExitCode run_cancel(const CommandContext& context) {
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  const Result<v1::Bake> bake = session->client.cancel(context.line.job, context.interrupt.once());
  if (!bake.ok()) return fail(context, bake.error());
  const bool has_ended = bake->state() >= v1::SUCCEEDED;
  context.reporter.answer(
      bake->name() + (has_ended ? "  " : "  asked to stop while ") + stage_name(bake->state()) + "\n", to_json(*bake));
  return kDone;
}

ExitCode run_finish(const CommandContext& context) {
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  const Result<v1::Bake> bake = session->client.finish(context.line.job, context.interrupt.once());
  if (!bake.ok()) return fail(context, bake.error());
  const bool has_ended = bake->state() >= v1::SUCCEEDED;
  context.reporter.answer(
      bake->name() + (has_ended ? "  " : "  asked to finish while ") + stage_name(bake->state()) + "\n",
      to_json(*bake));
  return kDone;
}

ExitCode run_download(const CommandContext& context) {
  Result<ResultFolder> folder = ResultFolder::open(context.line.folder, context.line.force);
  if (!folder.ok()) return fail(context, folder.error(), kUsage);
  Stopwatch stages;
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  stages.end_stage("connect");
  const Result<v1::Bake> bake = session->client.get(context.line.job, context.interrupt.once());
  if (!bake.ok()) return fail(context, bake.error());
  if (bake->state() < v1::SUCCEEDED) {
    return fail(context,
                {ErrorCode::kNotFound, bake->name() + " has no result yet: it is " + stage_name(bake->state()) +
                                           "; radbake watch " + bake->name() + " waits for it"},
                kUsage);
  }
  if (bake->state() != v1::SUCCEEDED) return fail_with(context, *bake);
  const std::stop_token stop = context.interrupt.once();
  std::optional<BakedScene> scene;
  if (context.line.scene.empty()) {
    context.reporter.note("scene.glb and lightmaps.json need the scene that was baked: --scene FILE");
  } else {
    Result<BakedScene> read = read_scene_of(session->client, *bake, context.line.scene, stop);
    if (!read.ok()) return fail(context, read.error());
    scene = std::move(read).value();
  }
  const Result<void> written = write_results(session->client, {*bake, std::nullopt, scene, context.line.files}, *folder,
                                             stages, context.reporter, stop);
  return written.ok() ? kDone : fail(context, written.error());
}

ExitCode run_capabilities(const CommandContext& context) {
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail_to_connect(context, session.error());
  const v1::Capabilities& server = session->client.capabilities();
  context.reporter.answer(describe(server), to_json(server));
  return kDone;
}

}  // namespace radbake::cli
