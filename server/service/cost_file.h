#pragma once

#include <filesystem>
#include <mutex>

#include "radbake/v1/plan.pb.h"

namespace radbake::service {

/// What bakes cost on this host, as the last of them measured it, kept in a file for one version of the engine.
///
/// Predictions rest on it, results never. A file that is missing, broken or of another version holds no costs. The
/// file: a line with the engine's version, then the fields of radbake.v1.HostCosts as protobuf's text. Thread-safe.
class CostFile {
 public:
  explicit CostFile(std::filesystem::path path);

  /// Zero: not known yet.
  v1::HostCosts costs() const;

  /// Takes the costs of another bake in: a new measurement counts 0.3, the past 0.7. What is not a cost is left out.
  /// A file that cannot be written is logged; the costs are then known until the server ends.
  void add(const v1::HostCosts& measured);

 private:
  void read();
  void write() const;

  const std::filesystem::path path_;
  mutable std::mutex mutex_;  // guards what follows, and the file
  v1::HostCosts costs_;
};

}  // namespace radbake::service
