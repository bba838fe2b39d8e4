#include "server/worker/memory_limit.h"

#include <sys/resource.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <system_error>

namespace radbake::worker {
namespace {

using Words = std::array<char, 100>;

/// Takes no memory: there may be none.
Words words_of_limit() {
  Words words{};
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    std::snprintf(words.data(), words.size(), "the bake needs more memory than its limit of %llu MiB",
                  static_cast<unsigned long long>(limit.rlim_cur >> 20));
  } else {
    std::snprintf(words.data(), words.size(), "the bake needs more memory than there is");
  }
  return words;
}

[[noreturn]] void end() {
  if (const std::exception_ptr reason = std::current_exception()) {
    try {
      std::rethrow_exception(reason);
    } catch (const std::exception& exception) {
      const Words words = words_of_limit();
      std::fprintf(stderr, "%s\n", is_lack_of_memory(exception) ? words.data() : exception.what());
    } catch (...) {  // nothing that could be named
    }
  }
  std::abort();
}

}  // namespace

Error out_of_memory() { return {ErrorCode::kResourceExhausted, words_of_limit().data()}; }

bool is_lack_of_memory(const std::exception& exception) {
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) return true;
  const auto* failure = dynamic_cast<const std::system_error*>(&exception);
  return failure != nullptr && failure->code() == std::errc::resource_unavailable_try_again;
}

void name_lack_of_memory_at_the_end() { std::set_terminate(end); }

}  // namespace radbake::worker
