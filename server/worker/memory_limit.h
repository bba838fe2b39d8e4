#pragma once

#include <exception>

#include "common/base/result.h"

namespace radbake::worker {

/// kResourceExhausted: what a bake is told that ran out of memory, with its limit if there is one.
Error out_of_memory();

/// Whether an exception says that there was no memory: an allocation failed, or a thread found no room for its stack.
bool is_lack_of_memory(const std::exception& exception);

/// From now on a thread that ends the process for lack of memory leaves that as its last words.
void name_lack_of_memory_at_the_end();

}  // namespace radbake::worker
