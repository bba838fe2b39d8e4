#include "client/cli/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "client/cli/exit_code.h"
#include "common/base/version.h"

namespace radbake::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class Options : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name :
         {"RADBAKE_SERVER", "RADBAKE_TLS_CA", "RADBAKE_TLS_CERT", "RADBAKE_TLS_KEY", "RADBAKE_TOKEN"}) {
      unsetenv(name);
    }
  }

  static std::vector<std::string> submit_with(std::vector<std::string> more) {
    std::vector<std::string> arguments = {"submit", "scene.glb", "-o", "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  static CommandLine accepted(const std::vector<std::string>& arguments) {
    const auto parsed = parse_command_line(arguments);
    if (const auto* exit = std::get_if<EarlyExit>(&parsed)) ADD_FAILURE() << exit->out << exit->err;
    return std::holds_alternative<CommandLine>(parsed) ? std::get<CommandLine>(parsed) : CommandLine();
  }

  static EarlyExit refused(const std::vector<std::string>& arguments) {
    const auto parsed = parse_command_line(arguments);
    EXPECT_TRUE(std::holds_alternative<EarlyExit>(parsed)) << testing::PrintToString(arguments) << " was accepted";
    return std::holds_alternative<EarlyExit>(parsed) ? std::get<EarlyExit>(parsed) : EarlyExit();
  }
};

TEST_F(Options, ReadsEveryChoiceOfSubmit) {
  const CommandLine line = accepted(submit_with({"--server",
                                                 "bakery:7419",
                                                 "--atlas-size",
                                                 "256",
                                                 "--texels-per-meter",
                                                 "12.5",
                                                 "--lightmap-uv",
                                                 "unwrap",
                                                 "--output",
                                                 "both",
                                                 "--encoding",
                                                 "png-rgbm,exr,exr",
                                                 "--vertex-colors",
                                                 "--sky",
                                                 "1,2,3.5",
                                                 "--sun",
                                                 "0,-2,0:10,20,30",
                                                 "--rays",
                                                 "512",
                                                 "--max-patches",
                                                 "4000",
                                                 "--max-reflectance",
                                                 "0.9",
                                                 "--threads",
                                                 "2",
                                                 "--seed",
                                                 "7",
                                                 "--json",
                                                 "--force"}));
  EXPECT_EQ(line.command, Command::kSubmit);
  EXPECT_EQ(line.server, "bakery:7419");
  EXPECT_EQ(line.scene, "scene.glb");
  EXPECT_EQ(line.folder, "out");
  EXPECT_EQ(line.bake.atlas_size, 256u);
  EXPECT_EQ(line.bake.texels_per_meter, 12.5);
  EXPECT_EQ(line.bake.lightmap_uv, v1::LIGHTMAP_UV_UNWRAP);
  EXPECT_EQ(line.bake.output, v1::OUTPUT_BOTH);
  EXPECT_THAT(line.files.encodings, testing::ElementsAre(Encoding::kRgbmPng, Encoding::kExr));
  EXPECT_TRUE(line.files.vertex_colors);
  EXPECT_EQ(line.bake.sky, (Vec3{1, 2, 3.5}));
  ASSERT_TRUE(line.bake.sun.has_value());
  EXPECT_EQ(line.bake.sun->direction, (Vec3{0, -1, 0}));
  EXPECT_EQ(line.bake.sun->illuminance, (Vec3{10, 20, 30}));
  EXPECT_EQ(line.bake.rays, 512u);
  EXPECT_EQ(line.bake.max_patches, 4000u);
  EXPECT_EQ(line.bake.max_reflectance, 0.9);
  EXPECT_EQ(line.bake.threads, 2u);
  EXPECT_EQ(line.bake.seed, 7u);
  EXPECT_TRUE(line.json);
  EXPECT_TRUE(line.force);
}

TEST_F(Options, LeavesToTheServerWhatIsNotChosen) {
  const BakeChoices bake = accepted(submit_with({})).bake;
  EXPECT_EQ(bake.atlas_size, 0u);
  EXPECT_EQ(bake.rays, 0u);
  EXPECT_EQ(bake.max_patches, 0u);
  EXPECT_EQ(bake.threads, 0u);
  EXPECT_EQ(bake.max_reflectance, 0.98);
  EXPECT_EQ(bake.texels_per_meter, 0);
  EXPECT_EQ(bake.lightmap_uv, v1::LIGHTMAP_UV_AUTO);
  EXPECT_EQ(bake.output, v1::OUTPUT_LIGHTMAP);
  EXPECT_FALSE(bake.sky.has_value());
  EXPECT_FALSE(bake.sun.has_value());
}

TEST_F(Options, TakesASunThatStartsWithAMinus) {
  const CommandLine line = accepted(submit_with({"--sun", "-1,0,0:1,1,1"}));
  ASSERT_TRUE(line.bake.sun.has_value());
  EXPECT_EQ(line.bake.sun->direction, (Vec3{-1, 0, 0}));
}

TEST_F(Options, TakesTheWholeRangeOfSeeds) {
  EXPECT_EQ(accepted(submit_with({"--seed", "18446744073709551615"})).bake.seed, UINT64_MAX);
}

TEST_F(Options, TakesTheServerFromTheEnvironment) {
  setenv("RADBAKE_SERVER", "unix:/run/radbake", 1);
  EXPECT_EQ(accepted({"list"}).server, "unix:/run/radbake");
  EXPECT_EQ(accepted({"list", "--server", "other:1"}).server, "other:1");
  unsetenv("RADBAKE_SERVER");
}

TEST_F(Options, NamesAJobByItsIdToo) {
  EXPECT_EQ(accepted({"watch", "bakes/3f", "--server", "s"}).job, "bakes/3f");
  EXPECT_EQ(accepted({"watch", "3f", "--server", "s"}).job, "bakes/3f");
  EXPECT_EQ(accepted({"finish", "3f", "--server", "s"}).job, "bakes/3f");
  EXPECT_EQ(accepted({"finish", "3f", "--server", "s"}).command, Command::kFinish);
}

TEST_F(Options, NeedsAServerForOtherPeoplesBakes) {
  const std::vector<std::vector<std::string>> commands = {
      {"list"}, {"watch", "3f"}, {"finish", "3f"}, {"cancel", "3f"}, {"download", "3f", "-o", "out"}};
  for (const auto& arguments : commands) {
    const EarlyExit exit = refused(arguments);
    EXPECT_EQ(exit.code, kUsage);
    EXPECT_THAT(exit.err, AllOf(HasSubstr(arguments[0]), HasSubstr("--server"), HasSubstr("RADBAKE_SERVER")));
  }
}

struct BadOption {
  std::vector<std::string> arguments;
  std::string named;
};

class BadOptions : public Options, public testing::WithParamInterface<BadOption> {};

TEST_P(BadOptions, AreUsageErrorsThatNameOptionAndValue) {
  const EarlyExit exit = refused(submit_with(GetParam().arguments));
  EXPECT_EQ(exit.code, kUsage);
  EXPECT_THAT(exit.out, IsEmpty());
  EXPECT_THAT(exit.err, HasSubstr(GetParam().named));
  EXPECT_THAT(exit.err, HasSubstr(GetParam().arguments[0]));
}

INSTANTIATE_TEST_SUITE_P(
    Submit, BadOptions,
    testing::Values(
        BadOption{{"--atlas-size", "100"}, "'100' is not a power of two from 64 to 4096"},
        BadOption{{"--atlas-size", "32"}, "'32'"}, BadOption{{"--atlas-size", "8192"}, "'8192'"},
        BadOption{{"--atlas-size", "0"}, "'0'"}, BadOption{{"--atlas-size", "-256"}, "'-256'"},
        BadOption{{"--atlas-size", "256x"}, "'256x'"}, BadOption{{"--sky", "1,2"}, "R,G,B"},
        BadOption{{"--sky", "1,2,3,4"}, "R,G,B"}, BadOption{{"--sky", "1,2,-3"}, "below 0"},
        BadOption{{"--sky", "1,x,3"}, "'x' is not a number"}, BadOption{{"--sky", "1,nan,3"}, "'nan' is not finite"},
        BadOption{{"--sky", "1,1e999,3"}, "'1e999'"}, BadOption{{"--sky", ""}, "R,G,B"},
        BadOption{{"--sun", "0,0,0:1,1,1"}, "0,0,0 is zero"}, BadOption{{"--sun", "0,-1,0"}, "DX,DY,DZ:R,G,B"},
        BadOption{{"--sun", "0,-1,0:1,1,-1"}, "below 0"}, BadOption{{"--sun", "0,inf,0:1,1,1"}, "'inf' is not finite"},
        BadOption{{"--lightmap-uv", "mine"}, "'mine' is none of auto, keep, unwrap"},
        BadOption{{"--output", "picture"}, "'picture' is none of both, lightmap, vertices"},
        BadOption{{"--encoding", "exr,jpg"}, "'jpg' is none of exr, hdr, png-rgbm"},
        BadOption{{"--encoding", ""}, "'' is none of"}, BadOption{{"--encoding", "exr,"}, "'' is none of"},
        BadOption{{"--texels-per-meter", "0"}, "'0' is not a number from 0.001"},
        BadOption{{"--texels-per-meter", "nan"}, "'nan'"}, BadOption{{"--texels-per-meter", "1e9"}, "'1e9'"},
        BadOption{{"--vertex-colors"}, "--output vertices"},
        BadOption{{"--rays", "0"}, "'0' is not a whole number from 1"}, BadOption{{"--rays", "1.5"}, "'1.5'"},
        BadOption{{"--rays", "-5"}, "'-5'"}, BadOption{{"--rays", "99999999999999999999999"}, "999"},
        BadOption{{"--max-patches", "0"}, "'0'"}, BadOption{{"--max-patches", "many"}, "'many'"},
        BadOption{{"--max-reflectance", "1"}, "'1' is not a number from 0 to below 1"},
        BadOption{{"--max-reflectance", "-0.1"}, "'-0.1'"}, BadOption{{"--max-reflectance", "nan"}, "'nan'"},
        BadOption{{"--threads", "0"}, "'0'"}, BadOption{{"--seed", "-1"}, "-1"}, BadOption{{"--seed", "x"}, "x"},
        BadOption{{"--sun", "0,-1,0:1,1,1:180"}, "'180' degrees"},
        BadOption{{"--hdri", "dawn.hdr:0"}, "'0' as a scale"},
        BadOption{{"--hdri", "dawn.hdr", "--sky", "1,1,1"}, "--sky"},
        BadOption{{"--effect", "caustics=on"}, "'caustics' is none of emitters, point"},
        BadOption{{"--max-error", "200%"}, "'200%' is neither a percentage"},
        BadOption{{"--max-error", "-2%"}, "'-2%' is neither a percentage"},
        BadOption{{"--time-budget", "soon"}, "'soon' is not a time"},
        BadOption{{"--quality", "best"}, "'best' is none of draft"},
        BadOption{{"--quality", "draft", "--max-error", "2%"}, "--max-error"},
        BadOption{{"--rays", "64", "--max-error", "2%"}, "--max-error"},
        BadOption{{"--rays", "64", "--time-budget", "2s"}, "--time-budget"},
        BadOption{{"--strict"}, "needs an error to reach: --max-error or --quality"},
        BadOption{{"--strict", "--time-budget", "2s"}, "needs an error to reach"},
        BadOption{{"--layers", "glow"}, "'glow' is none of ao, direct, indirect"},
        BadOption{{"--layers", "ao", "--output", "vertices"}, "--output vertices makes none"},
        BadOption{{"--ao-distance", "2"}, "needs --layers ao"}, BadOption{{"--frobnicate"}, "--frobnicate"}));

TEST_F(Options, NamesWhatIsMissing) {
  EXPECT_EQ(refused({}).code, kUsage);
  EXPECT_EQ(refused({"frobnicate"}).code, kUsage);
  EXPECT_THAT(refused({"submit", "-o", "out"}).err, HasSubstr("SCENE"));
  EXPECT_THAT(refused({"submit", "scene.glb"}).err, HasSubstr("--out"));
  EXPECT_THAT(refused({"watch", "--server", "s"}).err, HasSubstr("JOB"));
}

TEST_F(Options, PlanTakesWhatDecidesABakeAndNoFolder) {
  const CommandLine line =
      accepted({"plan", "scene.glb", "--sky", "1,2,3", "--rays", "64", "--effect", "color=off", "--deadline", "2.5"});
  EXPECT_EQ(line.command, Command::kPlan);
  EXPECT_TRUE(line.only_plans());
  EXPECT_EQ(line.scene, "scene.glb");
  EXPECT_EQ(line.bake.rays, 64u);
  EXPECT_EQ(line.bake.effects.at("color"), v1::EFFECT_CHOICE_OFF);
  EXPECT_EQ(line.plan_seconds, 2.5);
  EXPECT_EQ(accepted({"plan", "scene.glb"}).plan_seconds, 60);
  EXPECT_EQ(refused({"plan", "scene.glb", "-o", "out"}).code, kUsage);
  EXPECT_EQ(refused({"plan"}).code, kUsage);
  EXPECT_EQ(refused({"plan", "scene.glb", "--deadline", "0"}).code, kUsage);
}

TEST_F(Options, TakesATargetABudgetAndStrictness) {
  const CommandLine line = accepted(submit_with({"--max-error", "2%", "--time-budget", "1m", "--strict"}));
  EXPECT_EQ(line.bake.max_error, 0.02);
  EXPECT_EQ(line.bake.time_budget_ms, 60'000u);
  EXPECT_TRUE(line.strict);
  EXPECT_TRUE(accepted(submit_with({"--quality", "draft", "--strict"})).strict);
  EXPECT_FALSE(accepted(submit_with({})).strict);
  EXPECT_EQ(accepted({"plan", "scene.glb", "--quality", "draft", "--time-budget", "5s"}).bake.quality, "draft");
  EXPECT_EQ(refused({"plan", "scene.glb", "--max-error", "2%", "--rays", "64"}).code, kUsage);
  EXPECT_EQ(refused({"plan", "scene.glb", "--max-error", "2%", "--strict"}).code, kUsage);
}

TEST_F(Options, ADryRunNeedsNoFolder) {
  const CommandLine line = accepted({"submit", "scene.glb", "--dry-run"});
  EXPECT_TRUE(line.only_plans());
  EXPECT_TRUE(line.folder.empty());
  EXPECT_FALSE(accepted(submit_with({})).only_plans());
  EXPECT_TRUE(accepted(submit_with({"--dry-run"})).only_plans());
}

TEST_F(Options, TakesTheSceneOfADownload) {
  const CommandLine line = accepted(
      {"download", "3f", "-o", "out", "--server", "s", "--scene", "room.glb", "--encoding", "hdr", "--vertex-colors"});
  EXPECT_EQ(line.scene, "room.glb");
  EXPECT_THAT(line.files.encodings, testing::ElementsAre(Encoding::kHdr));
  EXPECT_TRUE(line.files.vertex_colors);
  EXPECT_TRUE(accepted({"download", "3f", "-o", "out", "--server", "s"}).scene.empty());
}

TEST_F(Options, SubmitNamesEveryFileThatItWrites) {
  const std::string help = refused({"submit", "--help"}).out;
  for (const char* word : {"scene.glb", "lightmap_N.exr", "error_N.exr", "lightmap_N.png", "lightmaps.json",
                           "report.json", "MOZ_lightmap", "_IRRADIANCE", "radbake_texel_density"}) {
    EXPECT_THAT(help, HasSubstr(word));
  }
}

TEST_F(Options, HelpsEverywhereWithExamples) {
  for (const char* command : {"submit", "plan", "list", "watch", "finish", "cancel", "download", "capabilities"}) {
    const EarlyExit exit = refused({command, "--help"});
    EXPECT_EQ(exit.code, kDone);
    EXPECT_THAT(exit.err, IsEmpty());
    EXPECT_THAT(exit.out, AllOf(HasSubstr("Examples:\n  radbake "), HasSubstr("--server"), HasSubstr("Exit codes:"),
                                HasSubstr("7 error asked for")));
  }
  EXPECT_THAT(refused({"--help"}).out, AllOf(HasSubstr("Examples:"), HasSubstr("submit"), HasSubstr("capabilities")));
}

TEST_F(Options, TellsItsVersion) {
  const EarlyExit exit = refused({"--version"});
  EXPECT_EQ(exit.code, kDone);
  EXPECT_THAT(exit.out, HasSubstr(std::string("radbake ") + kEngineVersion + " (protocol 1."));
}

TEST_F(Options, ReadsWhatIsCompared) {
  const CommandLine line =
      accepted({"compare", "reference.exr", "map.exr", "--scale", "0.5", "--mask", "mask.png", "--edges", "--error",
                "error.exr", "--reference-error", "own.exr", "-o", "difference.png", "--json"});
  EXPECT_EQ(line.command, Command::kCompare);
  EXPECT_EQ(line.compare.reference, "reference.exr");
  EXPECT_EQ(line.compare.map, "map.exr");
  EXPECT_EQ(line.compare.scale, 0.5);
  EXPECT_EQ(line.compare.mask, "mask.png");
  EXPECT_TRUE(line.compare.with_edges);
  EXPECT_EQ(line.compare.error, "error.exr");
  EXPECT_EQ(line.compare.reference_error, "own.exr");
  EXPECT_EQ(line.compare.picture, "difference.png");
  EXPECT_TRUE(line.json);
  EXPECT_FALSE(accepted({"compare", "reference.exr", "map.exr"}).compare.with_edges);
  for (const char* scale : {"0", "-1", "nan", "1e999", "half"}) {
    EXPECT_THAT(refused({"compare", "reference.exr", "map.exr", "--scale", scale}).err, HasSubstr(scale));
  }
  EXPECT_EQ(refused({"compare", "reference.exr"}).code, kUsage);
}

TEST_F(Options, TakeSecurityFromTheLineAndElseFromTheEnvironment) {
  setenv("RADBAKE_TLS_CA", "their-ca.pem", 1);
  setenv("RADBAKE_TOKEN", "a-token", 1);
  const api::ClientSecurity given =
      accepted({"list", "--server", "bakery", "--tls-ca", "ca.pem", "--tls-cert", "me.pem", "--tls-key", "me.key"})
          .security;
  EXPECT_EQ(given.ca, "ca.pem");
  EXPECT_EQ(given.certificate, "me.pem");
  EXPECT_EQ(given.key, "me.key");
  EXPECT_EQ(given.token, "a-token");
  EXPECT_EQ(accepted({"list", "--server", "bakery"}).security.ca, "their-ca.pem");
  // A private server asks nobody who he is.
  EXPECT_EQ(accepted({"capabilities"}).security.token, "");
  setenv("RADBAKE_TOKEN", "no token", 1);
  EXPECT_THAT(refused({"list", "--server", "bakery"}).err, HasSubstr("RADBAKE_TOKEN"));
  EXPECT_THAT(refused({"list", "--server", "bakery", "--token-file", "/nonexistent/token"}).err,
              HasSubstr("--token-file /nonexistent/token"));
}

}  // namespace
}  // namespace radbake::cli
