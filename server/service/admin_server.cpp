#include "server/service/admin_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include "server/access/listen_address.h"

namespace radbake::service {
namespace {

constexpr std::size_t kNumThreads = 4;
constexpr std::size_t kMaxRequestBytes = 4096;
constexpr std::chrono::seconds kPatience{5};
constexpr const char* kText = "text/plain; charset=utf-8";
constexpr const char* kPrometheusText = "text/plain; version=0.0.4; charset=utf-8";

}  // namespace

struct AdminServer::Http {
  httplib::Server server;
  std::atomic<bool> has_ended = false;
  std::thread thread;
};

AdminServer::AdminServer() : http_(std::make_unique<Http>()) {}

AdminServer::~AdminServer() {
  if (!http_->thread.joinable()) return;
  http_->server.stop();
  http_->thread.join();
}

Result<std::unique_ptr<AdminServer>> AdminServer::start(const std::string& address, AdminPages pages) {
  std::unique_ptr<AdminServer> admin(new AdminServer());
  httplib::Server& server = admin->http_->server;
  // Who connects and says nothing must not keep the others out for long, nor fill the memory.
  server.new_task_queue = [] { return new httplib::ThreadPool(kNumThreads); };
  server.set_keep_alive_max_count(1);
  server.set_read_timeout(kPatience);
  server.set_write_timeout(kPatience);
  server.set_payload_max_length(kMaxRequestBytes);
  // The library's default would let a second server share the port unnoticed.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  server.Get("/livez", [](const httplib::Request&, httplib::Response& answer) { answer.set_content("ok\n", kText); });
  server.Get("/readyz", [pages](const httplib::Request&, httplib::Response& answer) {
    const std::string obstacles = pages.why_not_ready();
    answer.status = obstacles.empty() ? 200 : 503;
    answer.set_content(obstacles.empty() ? "ok\n" : obstacles, kText);
  });
  server.Get("/metrics", [pages](const httplib::Request&, httplib::Response& answer) {
    answer.set_content(pages.metrics(), kPrometheusText);
  });

  const auto parts = access::read_address(address);
  int bound = -1;
  if (parts && parts->port == 0) bound = server.bind_to_any_port(parts->host);
  if (parts && parts->port != 0 && server.bind_to_port(parts->host, parts->port)) bound = parts->port;
  if (bound < 0) {
    return Error{ErrorCode::kUnavailable,
                 "admin-listen is '" + address + "': expected an address of this machine with a port that is free"};
  }
  admin->address_ = address.substr(0, address.rfind(':') + 1) + std::to_string(bound);
  admin->http_->thread = std::thread([http = admin->http_.get()] {
    http->server.listen_after_bind();
    http->has_ended = true;
  });
  // To stop it before it runs would do nothing.
  while (!server.is_running() && !admin->http_->has_ended) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return admin;
}

}  // namespace radbake::service
