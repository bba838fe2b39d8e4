#include "server/study/cases.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace radbake::study {

using Json = nlohmann::ordered_json;

Result<Json> read_cases(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument("cannot read " + path.string());
  std::ostringstream text;
  text << file.rdbuf();
  Json cases = Json::parse(text.str(), nullptr, false);
  if (cases.is_discarded()) return invalid_argument(path.string() + " is not JSON");
  if (!cases.is_array()) return invalid_argument(path.string() + " holds no list of cases");
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (!cases[i].is_object()) {
      return invalid_argument(path.string() + ": case " + std::to_string(i) + " is not an object");
    }
  }
  return cases;
}

Result<void> write_text(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path building = path.string() + ".tmp";
  std::ofstream file(building, std::ios::binary);
  file << text;
  file.close();
  std::error_code failure;
  if (file) std::filesystem::rename(building, path, failure);
  if (file && !failure) return {};
  std::error_code ignored;
  std::filesystem::remove(building, ignored);
  return internal_error("cannot write " + path.string());
}

std::string id_of(const Json& result) {
  return result["id"].is_string() ? result["id"].get<std::string>() : result["id"].dump();
}

std::string Tally::judge(const Json& result) {
  if (!result["pass"].is_boolean()) return "";
  ++judged_;
  const bool is_passed = result["pass"].get<bool>();
  passed_ += is_passed;
  return is_passed ? "pass" : "FAIL";
}

std::string Tally::refuse(const Json& result) {
  ++refused_;
  return id_of(result) + ": refused: " + result["error"].get<std::string>() + "\n";
}

std::string Tally::summary(const std::string& what) const {
  return std::to_string(passed_) + " of " + std::to_string(judged_) + " " + what + " with a known answer pass; " +
         std::to_string(refused_) + " refused\n";
}

}  // namespace radbake::study
