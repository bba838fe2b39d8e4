#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/base/result.h"

namespace radbake::service {

/// What the admin port shows. Calls come from threads of its own.
struct AdminPages {
  std::function<std::string()> metrics;        ///< in Prometheus' text format
  std::function<std::string()> why_not_ready;  ///< empty: ready
};

/// A small HTTP server for those who watch this one, until it is destroyed:
///
///   /metrics  numbers; /livez  200 as long as the process answers; /readyz  200, or 503 with what stands in the way
///
/// Without authentication: it listens on the loopback unless the configuration says otherwise.
class AdminServer {
 public:
  /// address: HOST:PORT; port 0: any free one. Errors: kUnavailable for an address that cannot be listened on.
  static Result<std::unique_ptr<AdminServer>> start(const std::string& address, AdminPages pages);
  ~AdminServer();

  /// With the port that was chosen.
  const std::string& address() const { return address_; }

 private:
  struct Http;
  AdminServer();

  std::unique_ptr<Http> http_;
  std::string address_;
};

}  // namespace radbake::service
