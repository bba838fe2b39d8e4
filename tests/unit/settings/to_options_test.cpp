#include "server/settings/to_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/unset_fields.h"

namespace radbake::settings {
namespace {

TEST(Settings, AreAllRead) {
  v1::BakeSettings settings;
  settings.set_atlas_size(256);
  settings.set_texels_per_meter(16.5);
  settings.set_rays(512);
  settings.set_max_patches(1000);
  settings.set_seed(0xffffffffffffffff);
  settings.set_lightmap_uv(v1::LIGHTMAP_UV_UNWRAP);
  settings.set_output(v1::OUTPUT_BOTH);
  settings.set_form_factors(v1::FORM_FACTORS_HEMICUBE);
  settings.set_transport(v1::TRANSPORT_DENSE);
  settings.set_solver(v1::SOLVER_LU);
  settings.set_transport_memory_bytes(4096);
  const auto choose = [&settings](const char* effect, v1::EffectChoice choice) {
    v1::EffectOverride& change = *settings.add_effects();
    change.set_effect(effect);
    change.set_choice(choice);
  };
  choose("sun", v1::EFFECT_CHOICE_OFF);
  choose("color", v1::EFFECT_CHOICE_ON);
  choose("tint", v1::EFFECT_CHOICE_AUTO);
  settings.add_layers(v1::EXTRA_LAYER_INDIRECT);
  settings.add_layers(v1::EXTRA_LAYER_AO);
  settings.set_ao_distance(2.5);
  settings.set_max_error(0.02);
  settings.set_time_budget_ms(1500);
  EXPECT_THAT(unset_fields(settings), ::testing::IsEmpty());
  v1::RunOptions run;
  run.set_threads(3);
  const radiosity::BakeOptions options = to_options(settings, run);
  EXPECT_EQ(options.atlas_size, 256);
  EXPECT_EQ(options.texels_per_meter, 16.5);
  EXPECT_EQ(options.rays, 512);
  EXPECT_EQ(options.max_patches, 1000);
  EXPECT_EQ(options.seed, 0xffffffffffffffff);
  EXPECT_EQ(options.lightmap_uv, radiosity::LightmapUv::kUnwrap);
  EXPECT_EQ(options.output, radiosity::Output::kBoth);
  EXPECT_EQ(options.form_factors, radiosity::FormFactors::kHemicube);
  EXPECT_EQ(options.transport, radiosity::Transport::kDense);
  EXPECT_EQ(options.solver, radiosity::Solver::kLu);
  EXPECT_EQ(options.transport_memory, 4096u);
  EXPECT_EQ(options.threads, 3);
  EXPECT_EQ(options.effects,
            (radiosity::EffectOverrides{{radiosity::Effect::kSun, false}, {radiosity::Effect::kColor, true}}));
  EXPECT_FALSE(options.wants_direct);
  EXPECT_TRUE(options.wants_indirect);
  EXPECT_TRUE(options.wants_ao);
  EXPECT_EQ(options.ao_distance, 2.5);
  EXPECT_EQ(options.max_error, 0.02);
  EXPECT_EQ(options.time_budget_seconds, 1.5);
  EXPECT_FALSE(find_effect_problem(settings).has_value());
}

TEST(Settings, NameTheEffectOrLayerThatIsWrong) {
  const auto problem = [](const auto& spoil) {
    v1::BakeSettings settings;
    settings.add_effects()->set_effect("sun");
    spoil(settings);
    const auto found = find_effect_problem(settings);
    return found ? found->field + ": " + found->description : std::string();
  };
  using ::testing::StartsWith;
  EXPECT_EQ(problem([](v1::BakeSettings&) {}), "");
  EXPECT_THAT(problem([](auto& s) { s.add_effects()->set_effect("caustics"); }),
              StartsWith("settings.effects: 'caustics' is not an effect; there are emitters point"));
  EXPECT_EQ(problem([](auto& s) { s.add_effects()->set_effect("sun"); }),
            "settings.effects: 'sun' is chosen more than once");
  EXPECT_EQ(problem([](auto& s) { s.mutable_effects(0)->set_choice(static_cast<v1::EffectChoice>(9)); }),
            "settings.effects: 'sun': 9 is not an EffectChoice");
  EXPECT_EQ(problem([](auto& s) { s.add_layers(v1::EXTRA_LAYER_UNSPECIFIED); }),
            "settings.layers: 0 is not an ExtraLayer");
  EXPECT_EQ(problem([](auto& s) { s.add_layers(static_cast<v1::ExtraLayer>(4)); }),
            "settings.layers: 4 is not an ExtraLayer");
  EXPECT_EQ(problem([](auto& s) { s.set_ao_distance(-1); }),
            "settings.ao_distance: -1.000000 is not between 0 and 1000000");
  EXPECT_THAT(problem([](auto& s) { s.set_ao_distance(NAN); }), StartsWith("settings.ao_distance: "));
}

TEST(Settings, NameWhatIsBelowItsLeast) {
  const auto problem = [](const auto& spoil) {
    v1::BakeSettings settings;
    spoil(settings);
    const auto found = find_size_problem(settings);
    // What passes here must not be refused by the bake, and the other way round.
    EXPECT_EQ(radiosity::check_options(to_options(settings, {})).ok(), !found);
    return found ? found->field + ": " + found->description : std::string();
  };
  EXPECT_EQ(problem([](v1::BakeSettings&) {}), "");
  EXPECT_EQ(problem([](auto& s) { s.set_rays(8); }), "");
  EXPECT_EQ(problem([](auto& s) { s.set_rays(7); }), "settings.rays: 7 is below 8; 0: chosen for the scene");
  EXPECT_EQ(problem([](auto& s) { s.set_max_patches(64); }), "");
  EXPECT_EQ(problem([](auto& s) { s.set_max_patches(63); }),
            "settings.max_patches: 63 is below 64; 0: chosen for the scene");
  EXPECT_EQ(problem([](auto& s) { s.set_texels_per_meter(1e-6); }), "");
  EXPECT_EQ(problem([](auto& s) { s.set_texels_per_meter(1e-7); }),
            "settings.texels_per_meter: the value is below 0.000001; 0: chosen for the scene");
  EXPECT_EQ(problem([](auto& s) {
              s.set_output(v1::OUTPUT_VERTICES);
              s.add_layers(v1::EXTRA_LAYER_AO);
            }),
            "settings.layers: layers are lightmaps, and with output OUTPUT_VERTICES there are none");
}

TEST(Settings, NameTheTargetOrBudgetThatIsWrong) {
  const auto problem = [](double max_error, std::uint64_t budget_ms, unsigned rays = 0) {
    v1::BakeSettings settings;
    settings.set_max_error(max_error);
    settings.set_time_budget_ms(budget_ms);
    settings.set_rays(rays);
    const auto found = find_target_problem(settings);
    return found ? found->field + ": " + found->description : std::string();
  };
  using ::testing::StartsWith;
  EXPECT_EQ(problem(0, 0), "");
  EXPECT_EQ(problem(0.02, 1000), "");
  EXPECT_EQ(problem(0, kMaxTimeBudgetMs), "");
  EXPECT_EQ(problem(0, 0, 64), "");
  EXPECT_EQ(problem(-0.5, 0), "settings.max_error: -0.500000 is not at least 0 and below 1");
  EXPECT_EQ(problem(1, 0), "settings.max_error: 1.000000 is not at least 0 and below 1");
  EXPECT_THAT(problem(NAN, 0), StartsWith("settings.max_error: "));
  EXPECT_THAT(problem(INFINITY, 0), StartsWith("settings.max_error: inf "));
  EXPECT_EQ(problem(0, kMaxTimeBudgetMs + 1), "settings.time_budget_ms: 2592000001 is above 2592000000, 30 days");
  EXPECT_EQ(problem(0.02, 1000, 64),
            "settings.max_error: max_error 0.020000 chooses the rays by itself: not with rays 64");
  EXPECT_EQ(problem(0, 1000, 64),
            "settings.time_budget_ms: time_budget_ms 1000 chooses the rays by itself: not with rays 64");
}

/// The words of the wire are those of the library: what is chosen by name on one side has that name on the other.
TEST(Settings, AreMethodsOfTheSameName) {
  const auto lower = [](std::string name, const std::string& prefix) {
    name.erase(0, prefix.size());
    for (char& c : name) c = c == '_' ? '-' : static_cast<char>(std::tolower(c));
    return name;
  };
  for (int value = 0; value <= v1::FormFactors_MAX; ++value) {
    v1::BakeSettings settings;
    settings.set_form_factors(static_cast<v1::FormFactors>(value));
    EXPECT_EQ(radiosity::form_factors_name(to_options(settings, {}).form_factors),
              lower(v1::FormFactors_Name(settings.form_factors()), "FORM_FACTORS_"));
  }
  for (int value = 0; value <= v1::Transport_MAX; ++value) {
    v1::BakeSettings settings;
    settings.set_transport(static_cast<v1::Transport>(value));
    EXPECT_EQ(radiosity::transport_name(to_options(settings, {}).transport),
              lower(v1::Transport_Name(settings.transport()), "TRANSPORT_"));
  }
  EXPECT_FALSE(to_options({}, {}).solver.has_value());
  for (int value = 1; value <= v1::Solver_MAX; ++value) {
    v1::BakeSettings settings;
    settings.set_solver(static_cast<v1::Solver>(value));
    const auto solver = to_options(settings, {}).solver;
    ASSERT_TRUE(solver.has_value());
    EXPECT_EQ(radiosity::solver_name(*solver), lower(v1::Solver_Name(settings.solver()), "SOLVER_"));
  }
}

}  // namespace
}  // namespace radbake::settings
