#include "tests/service/health.h"

#include <grpcpp/impl/codegen/client_unary_call.h>
#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <thread>
#include <vector>

namespace radbake::testing {

Health health_of(const TestClient& client, const std::string& service) {
  // HealthCheckRequest { string service = 1; } and HealthCheckResponse { ServingStatus status = 1; }, byte for byte:
  // the messages of grpc.health.v1 are no part of the packages.
  std::string bytes;
  if (!service.empty()) bytes = std::string("\x0a") + static_cast<char>(service.size()) + service;
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  const auto context = new_context();
  const grpc::internal::RpcMethod method("/grpc.health.v1.Health/Check", grpc::internal::RpcMethod::NORMAL_RPC);
  const grpc::Status status =
      grpc::internal::BlockingUnaryCall(client.channel.get(), method, context.get(), request, &response);
  if (!status.ok()) return Health::kNoAnswer;
  std::vector<grpc::Slice> slices;
  response.Dump(&slices);
  std::string answer;
  for (const grpc::Slice& part : slices) answer.append(reinterpret_cast<const char*>(part.begin()), part.size());
  // Zero is not written.
  return answer.size() == 2 && answer[0] == 0x08 ? static_cast<Health>(answer[1]) : Health::kUnknown;
}

bool becomes(const TestClient& client, Health health) {
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  while (health_of(client) != health) {
    if (std::chrono::steady_clock::now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace radbake::testing
