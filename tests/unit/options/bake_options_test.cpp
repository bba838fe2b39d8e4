#include "client/options/bake_options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/options/effect_options.h"
#include "client/options/values.h"

namespace radbake::options {
namespace {

/// The settings that a command line asks for; what is wrong with it where it is refused.
struct Parsed {
  BakeChoices choices;
  v1::BakeSettings settings;
  std::string error;
};

Parsed parsed(std::vector<std::string> arguments) {
  Parsed result;
  CLI::App app;
  add_bake_options(app, result.choices);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    result.error = error.what();
  }
  result.settings = to_settings(result.choices);
  return result;
}

TEST(BakeOptions, NameEveryMethodOfFormFactorsTransportAndSolver) {
  for (const auto& [word, value] : {std::pair{"auto", v1::FORM_FACTORS_AUTO},
                                    {"analytic", v1::FORM_FACTORS_ANALYTIC},
                                    {"hemicube", v1::FORM_FACTORS_HEMICUBE},
                                    {"hemisphere", v1::FORM_FACTORS_HEMISPHERE},
                                    {"adaptive", v1::FORM_FACTORS_ADAPTIVE}}) {
    EXPECT_EQ(parsed({"--form-factors", word}).settings.form_factors(), value);
  }
  for (const auto& [word, value] : {std::pair{"auto", v1::TRANSPORT_AUTO},
                                    {"dense", v1::TRANSPORT_DENSE},
                                    {"sparse", v1::TRANSPORT_SPARSE},
                                    {"streamed", v1::TRANSPORT_STREAMED}}) {
    EXPECT_EQ(parsed({"--transport", word}).settings.transport(), value);
  }
  for (const auto& [word, value] : {std::pair{"auto", v1::SOLVER_AUTO},
                                    {"lu", v1::SOLVER_LU},
                                    {"jacobi", v1::SOLVER_JACOBI},
                                    {"gauss-seidel", v1::SOLVER_GAUSS_SEIDEL},
                                    {"southwell", v1::SOLVER_SOUTHWELL},
                                    {"shooting", v1::SOLVER_SHOOTING},
                                    {"krylov", v1::SOLVER_KRYLOV}}) {
    EXPECT_EQ(parsed({"--solver", word}).settings.solver(), value);
  }
}

TEST(BakeOptions, RefuseUnknownMethodsAndListThoseThatThereAre) {
  const std::string error = parsed({"--solver", "gauss"}).error;
  EXPECT_NE(error.find("'gauss'"), std::string::npos) << error;
  EXPECT_NE(error.find("gauss-seidel"), std::string::npos) << error;
  EXPECT_NE(parsed({"--transport", "csr"}).error.find("streamed"), std::string::npos);
  EXPECT_NE(parsed({"--form-factors", "rays"}).error.find("hemisphere"), std::string::npos);
}

TEST(BakeOptions, ReadMemoryInStepsOf1024) {
  EXPECT_EQ(parsed({"--memory", "2048"}).settings.transport_memory_bytes(), 2048u);
  EXPECT_EQ(parsed({"--memory", "1K"}).settings.transport_memory_bytes(), 1024u);
  EXPECT_EQ(parsed({"--memory", "3M"}).settings.transport_memory_bytes(), 3u << 20);
  EXPECT_EQ(parsed({"--memory", "4G"}).settings.transport_memory_bytes(), std::uint64_t{4} << 30);
  for (const char* bad : {"", "0", "-1", "1023", "4g", "4GB", "G", "1.5G", "1025G", "99999999999999999999", "4 G"}) {
    EXPECT_NE(parsed({"--memory", bad}).error, "") << bad;
    EXPECT_FALSE(parse_bytes(bad).ok()) << bad;
  }
}

TEST(BakeOptions, GiveTheSunADiscOf053DegreesUnlessTheySayElse) {
  // 0.53 degrees = 0.0092502 rad: 0.53 pi / 180.
  constexpr double kRounding = 1e-15;
  EXPECT_NEAR(parsed({"--sun", "0,-1,0:1,2,3"}).choices.sun->angular_diameter_radians, 0.00925024503556995, kRounding);
  EXPECT_EQ(parsed({"--sun", "0,-1,0:1,2,3:0"}).choices.sun->angular_diameter_radians, 0);
  const DirectionalLight sun = *parsed({"--sun", "0,-1,0:1,2,3:90"}).choices.sun;
  EXPECT_NEAR(sun.angular_diameter_radians, 1.5707963267948966, kRounding);
  EXPECT_EQ(sun.illuminance, (Vec3{1, 2, 3}));
  for (const char* bad : {"180", "-1", "nan", "inf", "", "wide", "1:2"}) {
    const Result<DirectionalLight> refused = parse_sun(std::string("0,-1,0:1,2,3:") + bad);
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_NE(refused.error().message.find(std::string("'") + bad + "'"), std::string::npos) << refused.error().message;
  }
}

TEST(BakeOptions, TakeASkyImageAndItsScale) {
  const auto image_of = [](const char* text) { return *parsed({"--hdri", text}).choices.sky_image; };
  EXPECT_EQ(image_of("dawn.hdr").file, "dawn.hdr");
  EXPECT_EQ(image_of("dawn.hdr").scale, 1);
  EXPECT_EQ(image_of("dawn.hdr:2000.5").file, "dawn.hdr");
  EXPECT_EQ(image_of("dawn.hdr:2000.5").scale, 2000.5);
  // What is no number belongs to the name.
  EXPECT_EQ(image_of("skies/at:dawn.hdr").file, "skies/at:dawn.hdr");
  EXPECT_EQ(image_of("skies/at:dawn.hdr:3").file, "skies/at:dawn.hdr");
  for (const char* bad : {"", ":2", "dawn.hdr:0", "dawn.hdr:-1", "dawn.hdr:nan", "dawn.hdr:inf"}) {
    EXPECT_NE(parsed({"--hdri", bad}).error, "") << bad;
  }
}

TEST(BakeOptions, RefuseTwoSkies) {
  const std::string error = parsed({"--sky", "1,1,1", "--hdri", "dawn.hdr"}).error;
  EXPECT_NE(error.find("--sky"), std::string::npos) << error;
  EXPECT_NE(error.find("--hdri"), std::string::npos) << error;
}

TEST(BakeOptions, GiveEqualBytesForEqualChoices) {
  const auto bytes_of = [](const std::vector<std::string>& arguments) {
    const Parsed result = parsed(arguments);
    EXPECT_EQ(result.error, "");
    return result.settings.SerializeAsString();
  };
  const std::string bytes = bytes_of({"--effect", "sun=off", "--effect", "color=on", "--layers", "ao,direct"});
  EXPECT_EQ(bytes, bytes_of({"--layers", "direct,ao,ao", "--effect", "color=on", "--effect", "sun=off"}));
  // What is said aloud and is so anyway.
  EXPECT_EQ(bytes, bytes_of({"--effect", "color=on", "--effect", "sun=off", "--effect", "sky=auto", "--layers",
                             "direct,ao", "--ao-distance", "1"}));
  EXPECT_NE(bytes, bytes_of({"--effect", "color=on", "--layers", "direct,ao"}));
  EXPECT_NE(bytes,
            bytes_of({"--effect", "color=on", "--effect", "sun=off", "--layers", "ao,direct", "--ao-distance", "2"}));

  const v1::BakeSettings settings =
      parsed({"--effect", "sun=off", "--effect", "color=on", "--layers", "ao,indirect", "--ao-distance", "2.5"})
          .settings;
  ASSERT_EQ(settings.effects_size(), 2);
  EXPECT_EQ(settings.effects(0).effect(), "color");
  EXPECT_EQ(settings.effects(0).choice(), v1::EFFECT_CHOICE_ON);
  EXPECT_EQ(settings.effects(1).effect(), "sun");
  EXPECT_EQ(settings.effects(1).choice(), v1::EFFECT_CHOICE_OFF);
  ASSERT_EQ(settings.layers_size(), 2);
  EXPECT_EQ(settings.layers(0), v1::EXTRA_LAYER_INDIRECT);
  EXPECT_EQ(settings.layers(1), v1::EXTRA_LAYER_AO);
  EXPECT_EQ(settings.ao_distance(), 2.5);
}

TEST(BakeOptions, NameEveryEffect) {
  for (const std::string_view name : kEffectNames) {
    const Parsed result = parsed({"--effect", std::string(name) + "=on"});
    EXPECT_EQ(result.error, "");
    ASSERT_EQ(result.settings.effects_size(), 1);
    EXPECT_EQ(result.settings.effects(0).effect(), name);
  }
}

TEST(BakeOptions, RefuseUnknownEffectsAndLayersAndListThoseThatThereAre) {
  const std::string error = parsed({"--effect", "caustics=on"}).error;
  EXPECT_NE(error.find("'caustics' is none of emitters, point,"), std::string::npos) << error;
  EXPECT_NE(error.find("volume"), std::string::npos) << error;
  EXPECT_NE(parsed({"--effect", "sun"}).error.find("NAME=on"), std::string::npos);
  EXPECT_NE(parsed({"--effect", "sun=maybe"}).error.find("'maybe' is none of auto, off, on"), std::string::npos);
  EXPECT_NE(parsed({"--effect", "sun=on", "--effect", "sun=off"}).error.find("'sun' is named twice"),
            std::string::npos);
  EXPECT_NE(parsed({"--layers", "direct,glow"}).error.find("'glow' is none of ao, direct, indirect"),
            std::string::npos);
  for (const char* bad : {"0", "-1", "nan", "inf", "far", "1e7", ""}) {
    EXPECT_NE(parsed({"--layers", "ao", "--ao-distance", bad}).error.find("metres"), std::string::npos) << bad;
  }
}

TEST(BakeOptions, FindWhatContradictsItself) {
  const auto problem_of = [](const std::vector<std::string>& arguments) {
    return find_contradiction(parsed(arguments).choices);
  };
  EXPECT_EQ(problem_of({"--layers", "ao", "--ao-distance", "2", "--output", "both"}), "");
  EXPECT_EQ(problem_of({"--layers", "direct", "--ao-distance", "2"}), "--ao-distance needs --layers ao");
  EXPECT_NE(problem_of({"--layers", "direct", "--output", "vertices"}).find("--output vertices"), std::string::npos);
}

}  // namespace
}  // namespace radbake::options
