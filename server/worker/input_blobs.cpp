#include "server/worker/input_blobs.h"

#include <unistd.h>

#include <cerrno>
#include <new>
#include <system_error>

namespace radbake::worker {

InputBlobs::InputBlobs(const v1::StartWork& start, const std::vector<int>& handed) {
  for (int i = 0; i < start.inputs_size(); ++i) {
    const v1::InputBlob& input = start.inputs(i);
    const auto index = static_cast<std::size_t>(i);
    descriptors_.emplace(Digest{input.digest().sha256(), input.digest().size_bytes()},
                         index < handed.size() ? handed[index] : input.fd());
  }
  for (int i = 0; i < start.checkpoints_size(); ++i) {
    const v1::Checkpoint& checkpoint = start.checkpoints(i);
    const auto index = static_cast<std::size_t>(start.inputs_size() + i);
    descriptors_.emplace(Digest{checkpoint.digest().sha256(), checkpoint.digest().size_bytes()},
                         index < handed.size() ? handed[index] : checkpoint.fd());
  }
}

Result<std::string> InputBlobs::read(const Digest& digest) const {
  const auto found = descriptors_.find(digest);
  if (found == descriptors_.end()) {
    return Error{ErrorCode::kNotFound, "blob " + digest.sha256 + " of " + std::to_string(digest.size_bytes) +
                                           " bytes is not among the inputs of this job"};
  }
  std::string bytes;
  try {
    bytes.resize(digest.size_bytes);
  } catch (const std::exception&) {  // bad_alloc, length_error
    return Error{ErrorCode::kResourceExhausted, "blob " + digest.sha256 + " of " + std::to_string(digest.size_bytes) +
                                                    " bytes does not fit into memory"};
  }

  // By pread: the position of a shared descriptor is not ours.
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t count = ::pread(found->second, bytes.data() + at, bytes.size() - at, static_cast<off_t>(at));
    if (count > 0) {
      at += static_cast<std::size_t>(count);
    } else if (count == 0) {
      return Error{ErrorCode::kDataLoss, "blob " + digest.sha256 + " ends after " + std::to_string(at) + " of " +
                                             std::to_string(digest.size_bytes) + " bytes"};
    } else if (errno != EINTR) {
      return internal_error("cannot read blob " + digest.sha256 + ": " + std::generic_category().message(errno));
    }
  }
  return bytes;
}

}  // namespace radbake::worker
