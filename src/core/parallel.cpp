#include "core/parallel.h"

#include <pmmintrin.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <utility>

namespace catoptric {
namespace {

std::unique_ptr<tbb::global_control>& control() {
  static std::unique_ptr<tbb::global_control> instance;
  return instance;
}

}  // namespace

void setThreadCount(int threads) {
  const unsigned hardware = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t count = threads > 0 ? static_cast<std::size_t>(threads) : hardware;
  control() =
      std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, count);
  // llvmpipe reads it when it makes a context; with 0 it rasterizes in the calling thread
  if (threads > 0)
    ::setenv("LP_NUM_THREADS", std::to_string(threads == 1 ? 0 : threads).c_str(), 1);
}

int threadCount() {
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(1, grain)),
      [&](const tbb::blocked_range<std::size_t>& range) {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
        body(range.begin(), range.end());
      },
      tbb::simple_partitioner());
}

struct Background::Group {
  tbb::task_group tasks;
};

Background::Background() : group_(std::make_unique<Group>()) {}

Background::~Background() {
  try {
    group_->tasks.wait();
  } catch (...) {  // of work that nobody waited for
  }
}

void Background::start(std::function<void()> work) {
  group_->tasks.run(std::move(work));
}

void Background::wait() {
  group_->tasks.wait();
}

}  // namespace catoptric
