// Parallel loops on TBB. Loop bodies write to disjoint memory, so results never depend on the
// number of threads. Sums over items are computed afterwards in a fixed order, or in integers.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace catoptric {

/// Limits all later parallel loops, Embree's builds and llvmpipe's rasterizer to `threads` threads;
/// 0 means all hardware threads. Call once, before the first loop and the first context.
void setThreadCount(int threads);

/// The number of threads that loops use.
int threadCount();

/// Calls body(begin, end) for disjoint ranges of about `grain` items that together cover 0..count.
/// Worker threads have flush-to-zero and denormals-are-zero set, as Embree requires. An exception
/// of a body is passed on to the caller.
void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body);

/// Work that runs on the loops' threads while the calling thread does something else.
class Background {
 public:
  Background();
  ~Background();  ///< waits for the work
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  void start(std::function<void()> work);
  /// Helps with the remaining work and waits for its end. Rethrows an exception of the work.
  void wait();

 private:
  struct Group;
  std::unique_ptr<Group> group_;
};

}  // namespace catoptric
