#pragma once

#include "client/api/client.h"

namespace radbake::api {

/// Delays short enough for a test, and enough of them for each failure that a test sets up.
inline ClientOptions impatient() {
  ClientOptions options;
  options.first_delay = std::chrono::milliseconds(2);
  options.max_delay = std::chrono::milliseconds(20);
  options.call_patience = std::chrono::milliseconds(300);
  options.stream_patience = std::chrono::milliseconds(300);
  return options;
}

}  // namespace radbake::api
