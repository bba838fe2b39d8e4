#pragma once

#include <optional>
#include <string>
#include <vector>

namespace radbake::radiosity {

/// Where a bake keeps what another attempt at it can go on from, and finds what an earlier one kept. A bake that is
/// stopped at any time and begun again, of the same scene and options by the same build, gives the same bytes as one
/// that ran through, and traces again only what was not kept. Called from one thread at a time.
class Checkpoints {
 public:
  virtual ~Checkpoints() = default;

  /// Names of what is kept, in no order.
  virtual std::vector<std::string> names() const = 0;
  /// Empty: it cannot be read; the bake does that part again.
  virtual std::optional<std::string> load(const std::string& name) = 0;
  /// In the place of what was kept under this name.
  virtual void save(const std::string& name, const std::string& bytes) = 0;
  virtual void drop(const std::vector<std::string>& names) = 0;
  /// Tells a log what was not kept, or what of it does not serve, and why.
  virtual void warn(const std::string& text) = 0;
  /// Seconds of work that may be lost: what is kept more often costs more than it saves.
  virtual double interval() const = 0;
};

}  // namespace radbake::radiosity
