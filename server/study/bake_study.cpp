#include "server/study/bake_study.h"

#include <chrono>
#include <cstdio>

#include "client/image/write_image.h"

namespace radbake::study {
namespace {

class Nobody final : public radiosity::BakeObserver {
 public:
  void on_progress(const radiosity::BakeProgress&) override {}
  void on_tile(const radiosity::Tile&) override {}
};

}  // namespace

Result<TimedBake> bake_timed(const Scene& scene, const radiosity::BakeOptions& options) {
  Nobody observer;
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  RADBAKE_ASSIGN_OR_RETURN(radiosity::BakeOutcome outcome, radiosity::bake_scene(scene, options, observer));
  return TimedBake{std::move(outcome), std::chrono::duration<double>(Clock::now() - start).count()};
}

std::string bake_table(const TimedBake& bake) {
  const radiosity::BakeReport& report = bake.outcome.report;
  char line[300];
  std::string text;
  for (const radiosity::StageTime& stage : report.stages) {
    std::snprintf(line, sizeof line, "%-16s %10.3f s\n", stage.stage.c_str(), stage.seconds);
    text += line;
  }
  std::snprintf(line, sizeof line, "%-16s %10.3f s\n", "bake", bake.seconds);
  text += line;
  std::snprintf(
      line, sizeof line, "%llu patches, %s form factors, %s transport; %s: %s after %d sweeps, error bound %.1e\n",
      static_cast<unsigned long long>(report.num_patches), radiosity::form_factors_name(report.plan.form_factors),
      radiosity::transport_name(report.plan.transport), report.solver.solver.c_str(), report.solver.status.c_str(),
      report.solver.sweeps, report.solver.relative_error_bound);
  text += line;
  std::snprintf(line, sizeof line, "%llu texels, %llu vertex groups; rays: %llu rows, %llu gather, %llu light; %s\n",
                static_cast<unsigned long long>(report.lightmap.num_texels),
                static_cast<unsigned long long>(report.vertices.num_groups),
                static_cast<unsigned long long>(report.num_row_rays),
                static_cast<unsigned long long>(report.num_gather_rays),
                static_cast<unsigned long long>(report.num_light_rays), report.instruction_set.c_str());
  return text + line;
}

Result<void> write_lightmaps(const radiosity::BakeOutcome& outcome, const std::filesystem::path& folder) {
  for (const radiosity::Layer& layer : outcome.layers) {
    RADBAKE_RETURN_IF_ERROR(
        image::write_exr(folder / (layer.name + ".exr"), layer.width, layer.height, layer.channels, layer.values));
  }
  return {};
}

}  // namespace radbake::study
