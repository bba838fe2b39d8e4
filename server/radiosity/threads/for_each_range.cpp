#include "server/radiosity/threads/for_each_range.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#ifdef RADBAKE_ANNOTATES_THREADS
#include <sanitizer/tsan_interface.h>
#endif

namespace radbake::radiosity {
namespace {

/// Tells the thread sanitizer of an order that oneTBB makes where it cannot see it: what comes before release() comes
/// before what follows acquire(). Nothing in other builds.
class Order {
 public:
#ifdef RADBAKE_ANNOTATES_THREADS
  void release() { __tsan_release(this); }
  void acquire() { __tsan_acquire(this); }
#else
  void release() {}
  void acquire() {}
#endif
};

}  // namespace

void for_each_range(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  // Two, so that one range is not ordered after another. At the ends of scopes, which what a body throws leaves too.
  Order fork, join;
  struct AcquireAtEnd {
    Order& order;
    ~AcquireAtEnd() { order.acquire(); }
  };
  struct ReleaseAtEnd {
    Order& order;
    ~ReleaseAtEnd() { order.release(); }
  };
  fork.release();
  const AcquireAtEnd joined{join};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain), [&](const tbb::blocked_range<std::size_t>& range) {
    fork.acquire();
    const ReleaseAtEnd done{join};
    body(range.begin(), range.end());
  });
}

}  // namespace radbake::radiosity
