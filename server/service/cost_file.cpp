#include "server/service/cost_file.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "common/base/version.h"

namespace radbake::service {
namespace {

constexpr double kWeightOfNew = 0.3;
/// CPU seconds that no ray, row or form factor takes.
constexpr double kImpossible = 1;

bool is_cost(double seconds) { return std::isfinite(seconds) && seconds > 0 && seconds < kImpossible; }

/// Calls change(old, new) for each field, and sets the field to what it returns.
template <typename Change>
void change_fields(v1::HostCosts& costs, const v1::HostCosts& other, const Change& change) {
  const auto& reflection = *costs.GetReflection();
  for (int i = 0; i < costs.GetDescriptor()->field_count(); ++i) {
    const auto* field = costs.GetDescriptor()->field(i);
    reflection.SetDouble(&costs, field, change(reflection.GetDouble(costs, field), reflection.GetDouble(other, field)));
  }
}

/// A file that cannot be parsed is no news: there are no costs then.
class Silence : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, google::protobuf::io::ColumnNumber, const std::string&) override {}
};

std::string first_line() { return std::string("radbake costs ") + kEngineVersion; }

}  // namespace

CostFile::CostFile(std::filesystem::path path) : path_(std::move(path)) { read(); }

v1::HostCosts CostFile::costs() const {
  const std::lock_guard lock(mutex_);
  return costs_;
}

void CostFile::add(const v1::HostCosts& measured) {
  const std::lock_guard lock(mutex_);
  change_fields(costs_, measured, [](double past, double now) {
    if (!is_cost(now)) return past;
    return is_cost(past) ? (1 - kWeightOfNew) * past + kWeightOfNew * now : now;
  });
  write();
}

void CostFile::read() {
  std::ifstream file(path_);
  std::string version;
  if (!std::getline(file, version) || version != first_line()) return;
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  google::protobuf::TextFormat::Parser parser;
  Silence silence;
  parser.RecordErrorsTo(&silence);
  v1::HostCosts read;
  if (!parser.ParseFromString(text, &read)) return;
  change_fields(costs_, read, [](double, double cost) { return is_cost(cost) ? cost : 0; });
}

void CostFile::write() const {
  std::string text;
  google::protobuf::TextFormat::PrintToString(costs_, &text);
  const std::filesystem::path fresh = path_.string() + ".new";
  {
    std::ofstream file(fresh);
    file << first_line() << '\n' << text;
    if (!file.flush()) return spdlog::warn("the costs of bakes cannot be written to {}", fresh.string());
  }
  // A reader finds the old file or the new one, never a part.
  std::error_code problem;
  std::filesystem::rename(fresh, path_, problem);
  if (problem) spdlog::warn("the costs of bakes cannot be written to {}: {}", path_.string(), problem.message());
}

}  // namespace radbake::service
