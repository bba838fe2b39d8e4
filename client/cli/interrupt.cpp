#include "client/cli/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "client/cli/exit_code.h"

namespace radbake::cli {
namespace {

sigset_t signals_to_stop() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  // nohup ignores SIGHUP: so do we then.
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

Interrupt::Interrupt() {
  const sigset_t set = signals_to_stop();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  thread_ = std::thread([this] { wait_for_signals(); });
}

Interrupt::~Interrupt() {
  // A signal to this one thread wakes it up for its end.
  is_over_ = true;
  pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
}

void Interrupt::wait_for_signals() {
  const sigset_t set = signals_to_stop();
  for (int count = 0;;) {
    int signal = 0;
    sigwait(&set, &signal);
    if (is_over_) return;
    if (count >= 3) _exit(kCancelledExit);
    count = signal == SIGINT ? count + 1 : std::max(count + 1, 2);
    if (count >= 1) once_.request_stop();
    if (count >= 2) twice_.request_stop();
    if (count >= 3) thrice_.request_stop();
  }
}

}  // namespace radbake::cli
