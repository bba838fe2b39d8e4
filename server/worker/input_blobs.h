#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "radbake/v1/worker.pb.h"

namespace radbake::worker {

/// The blobs that a worker inherited, or was handed, as open read-only descriptors. The store checked size and digest
/// when it took them; they are not hashed again.
class InputBlobs {
 public:
  /// `handed`: descriptors in the order of the inputs; empty: the inputs name them.
  explicit InputBlobs(const v1::StartWork& start, const std::vector<int>& handed = {});

  /// Errors: kNotFound for a blob that is not among the inputs, kDataLoss for a file that is shorter than its digest
  /// says.
  Result<std::string> read(const Digest& digest) const;

 private:
  std::map<Digest, int> descriptors_;
};

}  // namespace radbake::worker
