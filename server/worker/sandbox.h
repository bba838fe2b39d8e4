#pragma once

#include "common/base/result.h"

namespace radbake::worker {

/// Gives up, for this process and for good, all that a bake does not need: new privileges, files that grow, many
/// more descriptors, and every system call but those of threads, memory, clocks and descriptors that are open already.
///
/// Threads that run already are bound, too. What looks for a file finds none. What starts a process or a program, makes
/// a socket, writes to a path, traces or signals another process ends this one by SIGSYS.
/// A build with a sanitizer keeps its system calls: the sanitizer needs some of them.
/// Errors: kInternal names the step that the kernel refused; those before it hold.
Result<void> enter_sandbox();

/// Whether this build filters system calls.
bool filters_system_calls();

}  // namespace radbake::worker
