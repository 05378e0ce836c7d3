// Parallel loops over TBB. Bodies write to disjoint places, so results never depend on the
// number of threads; sums across items are made in order afterwards, or in integers.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace catoptric {

/// Limits every later parallel loop (and Embree's builds, which share the pool) to `threads`;
/// 0 means all hardware threads. Call once, before the first loop.
void setThreadCount(int threads);

/// The number of threads that loops use.
int threadCount();

/// Calls body(begin, end) for disjoint ranges that cover 0..count, each about `grain` long.
/// Worker threads have flush-to-zero and denormals-are-zero set, as Embree wants it.
/// An exception thrown by a body reaches the caller.
void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body);

/// Work of the threads of the loops while the calling thread does something else.
class Background {
 public:
  Background();
  ~Background();  ///< waits
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  void start(std::function<void()> work);
  /// Takes part in what is left of it; an exception of the work reaches the caller.
  void wait();

 private:
  struct Group;
  std::unique_ptr<Group> group_;
};

}  // namespace catoptric
