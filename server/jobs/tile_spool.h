#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/store/file_descriptor.h"

namespace radbake::jobs {

/// The tiles of one attempt, in the order in which they came, in a file that has no name: any number of watchers read
/// them at their own pace, and the space is free again when the last of them has gone. Memory: 16 bytes a tile.
/// Thread-safe.
class TileSpool {
 public:
  static Result<std::shared_ptr<TileSpool>> create(const std::filesystem::path& folder);

  Result<void> append(const std::string& tile);
  std::size_t num_tiles() const;
  /// Precondition: index < num_tiles().
  Result<std::string> read(std::size_t index) const;

 private:
  struct Extent {
    std::uint64_t offset = 0;
    std::uint64_t size = 0;
  };
  explicit TileSpool(store::FileDescriptor file) : file_(std::move(file)) {}

  const store::FileDescriptor file_;
  mutable std::mutex mutex_;
  std::vector<Extent> extents_;
};

}  // namespace radbake::jobs
