#include "server/handover/handover.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/base/check.h"

namespace radbake::handover {
namespace {

/// Both ends are programs of one build on one machine: this is no wire format.
struct Message {
  std::array<char, 8> magic = {'r', 'a', 'd', 'b', 'a', 'k', 'e', '1'};
  std::uint32_t attempt = 0;
  std::uint32_t num_inputs = 0;
  std::array<char, kMaxJobBytes + 1> job = {};  // ends in 0
};

/// Room for the descriptors beside a message.
struct Control {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMaxInputs * sizeof(int))> bytes = {};
};

Error failure(const std::string& what) {
  return Error{errno == EPIPE || errno == ECONNRESET ? ErrorCode::kUnavailable : ErrorCode::kInternal,
               what + ": " + std::generic_category().message(errno)};
}

}  // namespace

Result<void> announce(int socket) {
  constexpr char kWaiting = 'w';
  if (::send(socket, &kWaiting, 1, MSG_NOSIGNAL) == 1) return {};
  return failure("cannot tell the server that the worker waits");
}

bool is_announced(int socket, std::chrono::milliseconds limit) {
  pollfd wanted{socket, POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&wanted, 1, static_cast<int>(limit.count()));
  } while (ready < 0 && errno == EINTR);
  char said = 0;
  return ready == 1 && ::recv(socket, &said, 1, MSG_DONTWAIT) == 1;
}

bool fits(const Assignment& assignment) {
  return assignment.inputs.size() <= kMaxInputs && assignment.job.size() <= kMaxJobBytes;
}

Result<void> give(int socket, const Assignment& assignment) {
  RADBAKE_CHECK(fits(assignment));
  Message message;
  message.attempt = assignment.attempt;
  message.num_inputs = static_cast<std::uint32_t>(assignment.inputs.size());
  std::memcpy(message.job.data(), assignment.job.data(), assignment.job.size());
  iovec bytes{&message, sizeof message};
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  Control control;
  if (!assignment.inputs.empty()) {
    const std::size_t size = assignment.inputs.size() * sizeof(int);
    header.msg_control = control.bytes.data();
    header.msg_controllen = CMSG_SPACE(size);
    cmsghdr* part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(size);
    std::memcpy(CMSG_DATA(part), assignment.inputs.data(), size);
  }
  // The first message on an empty socket: it goes in one piece.
  const ssize_t sent = ::sendmsg(socket, &header, MSG_NOSIGNAL);
  if (sent != static_cast<ssize_t>(sizeof message)) return failure("cannot hand a job over");
  return {};
}

Result<Assignment> take(int socket) {
  pollfd waited{socket, POLLIN, 0};
  while (::poll(&waited, 1, -1) < 0 && errno == EINTR) {
  }
  Message message;
  iovec bytes{&message, sizeof message};
  Control control;
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  header.msg_control = control.bytes.data();
  header.msg_controllen = control.bytes.size();
  const ssize_t count = ::recvmsg(socket, &header, MSG_CMSG_CLOEXEC);
  if (count == 0) return Error{ErrorCode::kUnavailable, "the server went before it had work"};
  if (count < 0) return failure("cannot take a job over");

  Assignment assignment;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    assignment.inputs.resize((part->cmsg_len - CMSG_LEN(0)) / sizeof(int));
    std::memcpy(assignment.inputs.data(), CMSG_DATA(part), assignment.inputs.size() * sizeof(int));
  }
  if (count != static_cast<ssize_t>(sizeof message) || message.magic != Message().magic ||
      message.num_inputs != assignment.inputs.size() || message.job.back() != 0) {
    return internal_error("what was handed over is no job");
  }
  assignment.job = message.job.data();
  assignment.attempt = message.attempt;
  return assignment;
}

}  // namespace radbake::handover
