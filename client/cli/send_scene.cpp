#include "client/cli/send_scene.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/cli/scene_file.h"
#include "client/options/scene_light.h"

namespace radbake::cli {
namespace {

Error interrupted() { return {ErrorCode::kCancelled, "cancelled before the bake was submitted"}; }

}  // namespace

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

Result<ReadScene> read_and_encode(const CommandContext& context, Stopwatch& stages) {
  const CommandLine& line = context.line;
  const std::stop_token stop = context.interrupt.once();
  context.reporter.stage("reading", -1);
  ReadScene read;
  RADBAKE_ASSIGN_OR_RETURN(read.scene, read_scene(line.scene, line.bake.max_reflectance));
  RADBAKE_RETURN_IF_ERROR(options::add_sky_and_sun(line.bake, read_sky_image, read.scene.scene));
  read.report.num_triangles_dropped = read.scene.num_triangles_dropped;
  read.report.warnings = std::move(read.scene.warnings);
  // A plan has its warnings on its page.
  if (!line.only_plans()) {
    for (const Warning& warning : read.report.warnings) context.reporter.warning(warning);
  }
  RADBAKE_RETURN_IF_ERROR(options::require_light(read.scene.scene, line.scene.filename().string()));
  stages.end_stage("read");
  if (stop.stop_requested()) return interrupted();

  context.reporter.stage("encoding", -1);
  EncodeOptions encoding;
  encoding.atlas_size = static_cast<int>(line.bake.atlas_size);
  if (line.bake.texels_per_meter > 0) encoding.texels_per_meter = line.bake.texels_per_meter;
  RADBAKE_ASSIGN_OR_RETURN(read.encoded, encode_scene(read.scene.scene, encoding));
  read.report.mesh_transfer = read.encoded.transfer;
  stages.end_stage("encode");
  if (stop.stop_requested()) return interrupted();
  return read;
}

Result<void> upload(const CommandContext& context, api::Client& client, const EncodedScene& encoded,
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
  return {};
}

}  // namespace radbake::cli
