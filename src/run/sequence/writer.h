// Encodes and writes frames in background threads, behind a bounded queue.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "run/folder/run_folder.h"
#include "run/sequence/sequence.h"

namespace catoptric::run {

/// A rendered frame that waits to be written.
struct Job {
  const FrameTask* task = nullptr;
  RenderedFrame frame;
};

class Writer {
 public:
  /// Keeps references to `folder` and `encode`. `origin`: see FrameRecord.
  Writer(RunFolder& folder, const Encoder& encode, FrameOrigin origin, int threads, int capacity);
  ~Writer() { close(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Adds a job; waits until the queue has room. Returns false after a permanent write failure; no
  /// more jobs are accepted then.
  bool submit(Job job);
  /// Waits until everything is written.
  void close();

  bool failed();
  void rethrow();
  /// Valid after close().
  const std::vector<FailedFrame>& failures() const { return failures_; }
  const std::vector<int>& written() const { return written_; }

 private:
  void work();
  void write(Job& job);

  RunFolder& folder_;
  const Encoder& encode_;
  FrameOrigin origin_;
  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable room_;
  std::condition_variable work_;
  std::deque<Job> queue_;
  bool closed_ = false;
  std::exception_ptr fatal_;
  std::vector<FailedFrame> failures_;
  std::vector<int> written_;
  std::vector<std::thread> threads_;
};

}  // namespace catoptric::run
