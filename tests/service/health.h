#pragma once

#include <string>

#include "tests/service/test_server.h"

namespace radbake::testing {

/// What grpc.health.v1 says of a service; the numbers are the wire's.
enum class Health { kNoAnswer = -1, kUnknown = 0, kServing = 1, kNotServing = 2 };

/// service: "" is the server as a whole.
Health health_of(const TestClient& client, const std::string& service = "");

/// Asks until it is so; false when the time for a call is over.
bool becomes(const TestClient& client, Health health);

}  // namespace radbake::testing
