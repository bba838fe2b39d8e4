#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "server/study/cases.h"
#include "server/study/enclosure_study.h"
#include "server/study/form_factor_study.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;

const char kSquares[] = R"([{"id": "squares", "from": 0, "to": 1, "occluders": [], "exact": 0.19982489569838738,
  "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,1],[1,1,1],[1,0,1],[0,0,1]]]}])";

TEST(FormFactorStudy, ReportsValueErrorsAndMethod) {
  const Json result = study_form_factors(Json::parse(kSquares), PairEstimator::kAnalytic, 1e-4);
  ASSERT_EQ(result["cases"].size(), 1U);
  const Json& found = result["cases"][0];
  EXPECT_NEAR(found["form_factor"].get<double>(), 0.19982489569838738, 1e-9);
  EXPECT_LE(found["true_error"].get<double>(), 1e-9);
  EXPECT_TRUE(found["pass"].get<bool>());
  EXPECT_NE(form_factor_table(result).find("1 of 1 cases with a known answer pass; 0 refused"), std::string::npos);
}

TEST(FormFactorStudy, FailsACaseWhoseAnswerIsOff) {
  Json cases = Json::parse(kSquares);
  cases[0]["exact"] = 0.21;
  EXPECT_FALSE(study_form_factors(cases, PairEstimator::kAnalytic, 1e-4)["cases"][0]["pass"].get<bool>());
}

TEST(FormFactorStudy, JudgesNoCaseWithoutAKnownAnswer) {
  Json cases = Json::parse(kSquares);
  cases[0].erase("exact");
  const Json found = study_form_factors(cases, PairEstimator::kAnalytic, 1e-4)["cases"][0];
  EXPECT_TRUE(found["true_error"].is_null());
  EXPECT_TRUE(found["pass"].is_null());
  EXPECT_FALSE(found["form_factor"].is_null());
}

TEST(FormFactorStudy, RefusesACaseAndGoesOnWithTheOthers) {
  Json cases = Json::parse(kSquares);
  cases.push_back(cases[0]);
  cases[0]["to"] = 7;
  const Json result = study_form_factors(cases, PairEstimator::kAnalytic, 1e-4);
  EXPECT_TRUE(result["cases"][0]["form_factor"].is_null());
  EXPECT_NE(result["cases"][0]["error"].get<std::string>().find("to is 7"), std::string::npos);
  EXPECT_TRUE(result["cases"][1]["pass"].get<bool>());
}

const char kPlates[] = R"([{"id": "plates", "F": [[0, 1], [1, 0]], "areas": [1, 1], "rho": [0.5, 0.8], "E": [1, 0],
  "B": [1.6666666666666667, 1.3333333333333333]}])";

TEST(EnclosureStudy, SolvesByEverySolverWithinItsBound) {
  const Json result = study_enclosures(Json::parse(kPlates), 1e-12);
  ASSERT_EQ(result["cases"].size(), 6U);
  for (const Json& found : result["cases"]) {
    EXPECT_EQ(found["status"], "converged") << found["solver"];
    EXPECT_LE(found["relative_error"].get<double>(), 1e-10) << found["solver"];
    EXPECT_TRUE(found["pass"].get<bool>()) << found["solver"];
  }
  EXPECT_NE(enclosure_table(result).find("6 of 6 solves"), std::string::npos);
}

TEST(EnclosureStudy, RefusesAReflectanceOfOneByName) {
  Json cases = Json::parse(kPlates);
  cases[0]["rho"][1] = 1;
  const Json result = study_enclosures(cases, 1e-12);
  ASSERT_EQ(result["cases"].size(), 1U);
  EXPECT_NE(result["cases"][0]["error"].get<std::string>().find("rho[1] is 1"), std::string::npos);
}

TEST(Cases, NameTheFileThatCannotBeRead) {
  EXPECT_NE(read_cases("/nowhere/cases.json").error().message.find("/nowhere/cases.json"), std::string::npos);
  const std::string path = testing::TempDir() + "/no_cases.json";
  std::ofstream(path) << "{\"id\": 1}";
  EXPECT_NE(read_cases(path).error().message.find("holds no list"), std::string::npos);
  std::ofstream(path) << "[1, ";
  EXPECT_NE(read_cases(path).error().message.find("is not JSON"), std::string::npos);
}

}  // namespace
}  // namespace radbake::study
