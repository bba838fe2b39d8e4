#include "server/jobs/tile_spool.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <utility>

#include "common/base/check.h"

namespace radbake::jobs {

Result<std::shared_ptr<TileSpool>> TileSpool::create(const std::filesystem::path& folder) {
  RADBAKE_RETURN_IF_ERROR(store::make_folders(folder));
  std::string name = (folder / "tiles-XXXXXX").string();
  store::FileDescriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (!file.is_open()) return store::system_error("cannot create a tile spool in " + folder.string());
  // Without a name it cannot outlive the server, however that ends.
  ::unlink(name.c_str());
  return std::shared_ptr<TileSpool>(new TileSpool(std::move(file)));
}

Result<void> TileSpool::append(const std::string& tile) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t offset = extents_.empty() ? 0 : extents_.back().offset + extents_.back().size;
  RADBAKE_RETURN_IF_ERROR(store::write_all(file_.get(), std::as_bytes(std::span(tile)), offset, "the tile spool"));
  extents_.push_back({offset, tile.size()});
  return {};
}

std::size_t TileSpool::num_tiles() const {
  const std::lock_guard lock(mutex_);
  return extents_.size();
}

Result<std::string> TileSpool::read(std::size_t index) const {
  Extent extent;
  {
    const std::lock_guard lock(mutex_);
    RADBAKE_CHECK_LT(index, extents_.size());
    extent = extents_[index];
  }
  return store::read_range(file_.get(), extent.offset, extent.size, "the tile spool");
}

}  // namespace radbake::jobs
