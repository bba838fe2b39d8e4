#include "client/options/target_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/options/effect_options.h"
#include "client/options/values.h"

namespace radbake::options {
namespace {

using testing::HasSubstr;

/// The choices that a command line makes; what is wrong with it where it is refused.
struct Parsed {
  BakeChoices choices;
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
  return result;
}

double error_of(const std::string& text) {
  const Parsed result = parsed({"--max-error", text});
  EXPECT_EQ(result.error, "");
  return to_settings(result.choices).max_error();
}

std::uint64_t budget_of(const std::string& text) {
  const Parsed result = parsed({"--time-budget", text});
  EXPECT_EQ(result.error, "");
  return to_settings(result.choices).time_budget_ms();
}

TEST(TargetOptions, TakeAnErrorAsAPercentageOrAFraction) {
  EXPECT_EQ(error_of("2%"), 0.02);
  EXPECT_EQ(error_of("0.02"), 0.02);
  EXPECT_EQ(error_of("2.5%"), 0.025);
  EXPECT_EQ(error_of("0.1%"), 0.001);
  EXPECT_EQ(error_of("99%"), 0.99);
  EXPECT_EQ(error_of("1e-3"), 0.001);
}

TEST(TargetOptions, RefuseAnErrorThatIsNoneAndSayWhatIsAllowed) {
  for (const char* bad : {"0", "0%", "-2%", "1", "100%", "2", "250%", "nan", "inf", "nan%", "", "%", "2 %", "2%%",
                          "two", "2percent", "0x1p-4"}) {
    const std::string error = parsed({"--max-error", bad}).error;
    EXPECT_THAT(error, HasSubstr("--max-error")) << bad;
    EXPECT_THAT(error, HasSubstr("'" + std::string(bad) + "' is neither a percentage such as 2% nor a fraction"))
        << bad;
  }
}

TEST(TargetOptions, TakeATimeInSecondsUnlessItSaysElse) {
  EXPECT_EQ(budget_of("30"), 30'000u);
  EXPECT_EQ(budget_of("30s"), 30'000u);
  EXPECT_EQ(budget_of("1.5s"), 1'500u);
  EXPECT_EQ(budget_of("250ms"), 250u);
  EXPECT_EQ(budget_of("5m"), 300'000u);
  EXPECT_EQ(budget_of("2h"), 7'200'000u);
  EXPECT_EQ(budget_of("720h"), 2'592'000'000u);
  EXPECT_EQ(budget_of("0.001"), 1u);
}

TEST(TargetOptions, RefuseATimeThatIsNoneAndSayWhatIsAllowed) {
  for (const char* bad : {"0", "0s", "-5", "0.1ms", "721h", "1e300", "nan", "inf", "", "s", "5 s", "5sec", "5S", "5d",
                          "soon", "5sm", "m5"}) {
    const std::string error = parsed({"--time-budget", bad}).error;
    EXPECT_THAT(error, HasSubstr("--time-budget")) << bad;
    EXPECT_THAT(error, HasSubstr("'" + std::string(bad) + "' is not a time from 1ms to 720h, such as 30 or 30s"))
        << bad;
  }
}

TEST(TargetOptions, NameErrorsByQuality) {
  for (const auto& [name, error] :
       {std::pair{"draft", 0.10}, {"preview", 0.05}, {"production", 0.02}, {"reference", 0.01}}) {
    const Parsed result = parsed({"--quality", name});
    EXPECT_EQ(result.error, "");
    EXPECT_EQ(asked_error(result.choices), error);
    EXPECT_EQ(to_settings(result.choices).max_error(), error);
  }
  EXPECT_THAT(parsed({"--quality", "best"}).error,
              HasSubstr("'best' is none of draft, preview, production, reference"));
}

TEST(TargetOptions, GiveEqualBytesForEqualTargets) {
  const auto bytes_of = [](const std::vector<std::string>& arguments) {
    return to_settings(parsed(arguments).choices).SerializeAsString();
  };
  EXPECT_EQ(bytes_of({"--quality", "production"}), bytes_of({"--max-error", "2%"}));
  EXPECT_EQ(bytes_of({"--max-error", "0.02", "--time-budget", "1m"}),
            bytes_of({"--time-budget", "60s", "--max-error", "2%"}));
  EXPECT_NE(bytes_of({"--time-budget", "1m"}), bytes_of({"--time-budget", "2m"}));
  // Settings without a target have the bytes, and so the bake key, that they had before there were targets.
  EXPECT_EQ(bytes_of({"--rays", "7", "--seed", "5"}), "\x18\x07\x28\x05");
}

TEST(TargetOptions, FindWhatContradictsATarget) {
  const auto problem_of = [](const std::vector<std::string>& arguments) {
    const Parsed result = parsed(arguments);
    EXPECT_EQ(result.error, "");
    return find_contradiction(result.choices);
  };
  EXPECT_EQ(problem_of({"--max-error", "2%", "--time-budget", "30s"}), "");
  EXPECT_EQ(problem_of({"--quality", "draft", "--time-budget", "30s", "--output", "both"}), "");
  EXPECT_EQ(problem_of({"--max-error", "2%", "--output", "vertices"}), "");
  EXPECT_EQ(problem_of({"--quality", "draft", "--max-error", "2%"}),
            "--quality is a name for a --max-error: give one of them");
  EXPECT_EQ(problem_of({"--rays", "64", "--max-error", "2%"}),
            "--rays says how much is done, --max-error what is to be reached: give one of them");
  EXPECT_EQ(problem_of({"--rays", "64", "--quality", "draft"}),
            "--rays says how much is done, --quality what is to be reached: give one of them");
  EXPECT_EQ(problem_of({"--rays", "64", "--time-budget", "1s"}),
            "--rays says how much is done, --time-budget how long it may take: give one of them");
}

}  // namespace
}  // namespace radbake::options
