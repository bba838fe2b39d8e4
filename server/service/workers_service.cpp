#include "server/service/workers_service.h"

#include <grpcpp/server_posix.h>

#include <chrono>

#include "server/service/report_reactor.h"

namespace radbake::service {
namespace {

// Workers are ours: this keeps a broken one from the server's memory, and lets the report of any scene through.
constexpr int kMaxReportBytes = 64 << 20;

}  // namespace

Result<void> WorkersService::start() {
  grpc::ServerBuilder builder;
  builder.RegisterService(this);
  builder.SetMaxReceiveMessageSize(kMaxReportBytes);
  server_ = builder.BuildAndStart();
  if (!server_) return internal_error("the gRPC server for workers does not start");
  return {};
}

void WorkersService::stop() {
  if (server_) server_->Shutdown(std::chrono::system_clock::now());
}

void WorkersService::adopt(store::FileDescriptor socket) {
  grpc::AddInsecureChannelFromFd(server_.get(), socket.release());
}

grpc::ServerBidiReactor<v1::WorkerReport, v1::WorkerCommand>* WorkersService::Report(grpc::CallbackServerContext*) {
  return ReportReactor::start(queue_, pool_, costs_, metrics_, limits_);
}

}  // namespace radbake::service
