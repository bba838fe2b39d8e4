#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "server/radiosity/bake/checkpoints.h"
#include "server/worker/input_blobs.h"
#include "server/worker/report_stream.h"

namespace radbake::worker {

/// Keeps checkpoints at the server, and reads those that it handed over with the work.
class StreamCheckpoints : public radiosity::Checkpoints {
 public:
  StreamCheckpoints(const v1::StartWork& start, const InputBlobs& inputs, std::uint64_t chunk_bytes,
                    ReportStream& stream);

  std::vector<std::string> names() const override;
  std::optional<std::string> load(const std::string& name) override;
  void save(const std::string& name, const std::string& bytes) override;
  void drop(const std::vector<std::string>& names) override;
  /// Logs it: the same words once.
  void warn(const std::string& text) override;
  double interval() const override { return interval_; }

 private:
  const InputBlobs& inputs_;
  const std::uint64_t chunk_bytes_;
  ReportStream& stream_;
  double interval_;
  std::set<std::string> warnings_;
  std::map<std::string, std::optional<Digest>> kept_;  ///< no digest: by this attempt
};

}  // namespace radbake::worker
