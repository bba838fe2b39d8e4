#include <algorithm>
#include <future>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/proto_json.h"
#include "client/cli/results.h"
#include "client/cli/scene_file.h"
#include "client/gltf/read_gltf.h"
#include "client/image/image_codec.h"
#include "client/options/scene_light.h"
#include "common/codec/scene_codec.h"

namespace radbake::cli {
namespace {

Error interrupted() { return {ErrorCode::kCancelled, "cancelled before the bake was submitted"}; }

/// The settings that a server would refuse, named by the option that asks for them.
Result<void> check_limits(const BakeChoices& bake, const v1::Limits& limits) {
  const auto check = [](const std::string& option, std::uint64_t value, std::uint64_t limit) -> Result<void> {
    if (limit == 0 || value <= limit) return {};
    return invalid_argument(option + " " + std::to_string(value) + " is above the server's limit of " +
                            std::to_string(limit));
  };
  RADBAKE_RETURN_IF_ERROR(check("--rays", bake.rays, limits.max_rays()));
  RADBAKE_RETURN_IF_ERROR(check("--max-patches", bake.max_patches, limits.max_patches()));
  return check("--atlas-size", bake.atlas_size, limits.max_atlas_size());
}

v1::SubmitBakeRequest make_request(const CommandLine& line, const Digest& manifest) {
  v1::SubmitBakeRequest request;
  request.set_request_id(api::make_request_id());
  request.mutable_manifest()->set_sha256(manifest.sha256);
  request.mutable_manifest()->set_size_bytes(manifest.size_bytes);
  *request.mutable_settings() = options::to_settings(line.bake);
  *request.mutable_run() = options::to_run_options(line.bake);
  // Protobuf's texts are UTF-8, file names are bytes.
  request.set_label(to_utf8(line.scene.filename().string()));
  return request;
}

/// A scene that is ready to be sent, and what is to be known of it afterwards.
struct Prepared {
  EncodedScene encoded;
  std::optional<SceneReport> report;
  std::optional<BakedScene> scene;
};

/// Reads the scene, with the command line's lights, and encodes it.
Result<Prepared> prepare(const CommandContext& context, Stopwatch& stages) {
  const CommandLine& line = context.line;
  const std::stop_token stop = context.interrupt.once();
  context.reporter.stage("reading", -1);
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, read_scene(line.scene, line.bake.max_reflectance));
  RADBAKE_RETURN_IF_ERROR(options::add_sky_and_sun(line.bake, read_sky_image, read.scene));
  for (const Warning& warning : read.warnings) context.reporter.warning(warning);
  RADBAKE_RETURN_IF_ERROR(options::require_light(read.scene, line.scene.filename().string()));
  SceneReport report;
  report.num_triangles_dropped = read.num_triangles_dropped;
  report.warnings = std::move(read.warnings);
  stages.end_stage("read");
  if (stop.stop_requested()) return interrupted();

  context.reporter.stage("encoding", -1);
  EncodeOptions encoding;
  encoding.atlas_size = static_cast<int>(line.bake.atlas_size);
  if (line.bake.texels_per_meter > 0) encoding.texels_per_meter = line.bake.texels_per_meter;
  RADBAKE_ASSIGN_OR_RETURN(EncodedScene encoded, encode_scene(read.scene, encoding));
  report.mesh_transfer = encoded.transfer;
  RADBAKE_ASSIGN_OR_RETURN(BakedScene kept, keep_for_writing(line.scene, std::move(read), encoded));
  stages.end_stage("encode");
  if (stop.stop_requested()) return interrupted();
  return Prepared{std::move(encoded), std::move(report), std::move(kept)};
}

Result<v1::Bake> upload_and_submit(const CommandContext& context, api::Client& client, const EncodedScene& encoded,
                                   Stopwatch& stages) {
  const std::stop_token stop = context.interrupt.once();
  std::vector<api::BlobView> blobs;
  for (const EncodedBlob& blob : encoded.blobs) blobs.push_back({blob.digest, blob.bytes});
  const auto show = [&](std::uint64_t done, std::uint64_t total) {
    context.reporter.stage("uploading",
                           static_cast<double>(done) / static_cast<double>(std::max<std::uint64_t>(total, 1)));
  };
  const Result<std::uint64_t> uploaded = client.upload_missing(blobs, show, stop);
  if (!uploaded.ok()) return stop.stop_requested() ? interrupted() : uploaded.error();
  stages.end_stage("upload");

  // Without the stop token: a submit that was sent and not answered would leave a bake that nobody can name.
  RADBAKE_ASSIGN_OR_RETURN(v1::Bake bake, client.submit(make_request(context.line, encoded.manifest)));
  context.reporter.submitted(bake);
  return bake;
}

/// Follows the bake to its end. A first Ctrl-C cancels it and goes on waiting, a second one gives up.
Result<v1::Bake> follow(const CommandContext& context, api::Client& client, const std::string& name) {
  std::uint64_t sequence = 0;
  const auto show = [&](const v1::WatchBakeResponse& response) {
    if (response.has_event()) sequence = response.event().sequence();
    context.reporter.watched(response);
  };
  Result<v1::Bake> bake = client.watch(name, {}, show, context.interrupt.once());
  if (bake.ok() || bake.error().code != ErrorCode::kCancelled || !context.interrupt.once().stop_requested())
    return bake;
  context.reporter.note("cancelling " + name + " (Ctrl-C again: do not wait)");
  const Result<v1::Bake> asked = client.cancel(name, context.interrupt.twice());
  if (!asked.ok()) return asked;
  return client.watch(name, {sequence, false}, show, context.interrupt.twice());
}

}  // namespace

ExitCode run_submit(const CommandContext& context) {
  const CommandLine& line = context.line;
  Result<ResultFolder> folder = ResultFolder::open(line.folder, line.force);
  if (!folder.ok()) return fail(context, folder.error(), kUsage);
  Stopwatch stages;
  context.reporter.stage("connecting", -1);
  Result<Session> session = open_session(context);
  if (!session.ok()) return fail(context, session.error());
  stages.end_stage("connect");
  const Result<void> within_limits = check_limits(line.bake, session->client.capabilities().limits());
  if (!within_limits.ok()) return fail(context, within_limits.error(), kUsage);

  // Load the image library aside: it costs 0.3 s of one core, and results are to be written as soon as they are there.
  auto loading = std::async(std::launch::async, [] { return image::load_image_codec(); });

  Result<Prepared> prepared = prepare(context, stages);
  if (!prepared.ok()) return fail(context, prepared.error());
  Result<v1::Bake> bake = upload_and_submit(context, session->client, prepared->encoded, stages);
  if (!bake.ok()) return fail(context, session->explain(bake.error()));
  const std::string name = bake->name();
  // Not after the bake: hours of work would be out of reach, on a private server for ever.
  if (const Result<const image::ImageCodec*> images = loading.get(); !images.ok()) {
    Error error = images.error();
    if (!line.server.empty()) error.message += "; " + name + " goes on: see radbake download " + name;
    return fail(context, error);
  }
  prepared->encoded.blobs.clear();  // what the server has needs no place here for the hours of a bake

  bake = follow(context, session->client, name);
  if (!bake.ok()) {
    Error error = session->explain(bake.error());
    if (!line.server.empty()) error.message += "; " + name + " may go on: see radbake watch " + name;
    return fail(context, error);
  }
  stages.end_stage("bake");
  if (bake->state() != v1::SUCCEEDED) return fail(context, error_of(*bake), exit_code_of(*bake));

  const Result<void> written = write_results(session->client, {*bake, prepared->report, prepared->scene, line.files},
                                             *folder, stages, context.reporter, context.interrupt.twice());
  if (!written.ok()) return fail(context, session->explain(written.error()));
  return kDone;
}

}  // namespace radbake::cli
