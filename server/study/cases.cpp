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

}  // namespace radbake::study
