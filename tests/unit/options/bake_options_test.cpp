#include "client/options/bake_options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

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

}  // namespace
}  // namespace radbake::options
