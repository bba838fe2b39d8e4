// What effects cost: CPU seconds of bakes as planned, and with each effect forced the other way, side by side.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/cpu_clock.h"
#include "tests/scenes/effect_rooms.h"

namespace {

using radbake::radiosity::BakeOptions;
using radbake::radiosity::Effect;
using radbake::tests::EffectRoom;

class Silent final : public radbake::radiosity::BakeObserver {
  void on_progress(const radbake::radiosity::BakeProgress&) override {}
  void on_tile(const radbake::radiosity::Tile&) override {}
};

struct Seconds {
  double bake = 0, solve = 0;  ///< CPU, all threads together; solve: of its stage, the energy audit included
};

/// Nothing where the bake is refused: without its only light.
std::optional<Seconds> seconds_of(const EffectRoom& room, const BakeOptions& options) {
  Silent observer;
  const double start = radbake::radiosity::process_cpu_seconds();
  const auto outcome = bake_scene(room.scene, options, observer);
  if (!outcome.ok()) return std::nullopt;
  Seconds seconds{radbake::radiosity::process_cpu_seconds() - start, 0};
  for (const auto& stage : outcome.value().report.stages) {
    if (stage.stage == "solving") seconds.solve = stage.cpu_seconds;
  }
  return seconds;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Bakes by turns with and without an override. Prints medians, and the median of the pairs' ratios.
void compare(const EffectRoom& room, const std::string& effect, bool is_on, const BakeOptions& options, int runs) {
  BakeOptions other = options;
  other.effects = {{radbake::radiosity::effect_by_name(effect).value(), is_on}};
  std::vector<double> planned, forced, ratios, solve_planned, solve_forced, solve_ratios;
  for (int run = 0; run < runs; ++run) {
    const auto a = seconds_of(room, options), b = seconds_of(room, other);
    if (!a || !b) return;
    planned.push_back(a->bake);
    forced.push_back(b->bake);
    ratios.push_back(b->bake / a->bake);
    solve_planned.push_back(a->solve);
    solve_forced.push_back(b->solve);
    solve_ratios.push_back(a->solve > 0 ? b->solve / a->solve : 0);
  }
  std::printf("%-24s %-22s %-4s %9.3f %9.3f %7.2f %10.4f %9.4f %7.2f\n", room.name.c_str(), effect.c_str(),
              is_on ? "on" : "off", median(planned), median(forced), median(ratios), median(solve_planned),
              median(solve_forced), median(solve_ratios));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What effects cost, in rooms of tests/scenes/effect_rooms.h");
  BakeOptions options;
  options.atlas_size = 128;
  options.rays = 64;
  options.threads = 1;
  int runs = 5;
  bool is_empty_only = false;
  app.add_option("--atlas", options.atlas_size, "texels along a side")->capture_default_str();
  app.add_option("--rays", options.rays, "a texel")->capture_default_str();
  app.add_option("--max-patches", options.max_patches, "0: 16384")->capture_default_str();
  app.add_option("--runs", runs, "bakes of each kind, by turns; medians are printed")->capture_default_str();
  app.add_flag("--empty-only", is_empty_only, "colour and occlusion in the empty convex room alone");
  CLI11_PARSE(app, argc, argv);

  std::printf("%-24s %-22s %-4s %9s %9s %7s %10s %9s %7s\n", "room", "effect", "to", "planned", "forced", "ratio",
              "solve", "forced", "ratio");
  const EffectRoom empty = radbake::tests::empty_room();
  for (const std::string& effect : empty.off) compare(empty, effect, true, options, runs);
  if (is_empty_only) return 0;
  for (const auto& rooms : {radbake::tests::rooms_with_effects(), radbake::tests::rooms_without_effects()}) {
    for (const EffectRoom& room : rooms) {
      for (const std::string& effect : room.off) compare(room, effect, true, options, runs);
      for (const std::string& effect : room.on) compare(room, effect, false, options, runs);
    }
  }
  return 0;
}
