#include "run/sequence/writer.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"

namespace catoptric::run {
namespace {

/// By which writers are nicer than the threads that render (ours): where both want a processor
/// writers get about a quarter of it. Much less, and programs beside this one would starve them.
constexpr int kWriterNiceness = 5;

}  // namespace

Writer::Writer(RunFolder& folder, const Encoder& encode, FrameOrigin origin, int threads,
               int capacity)
    : folder_(folder),
      encode_(encode),
      origin_(std::move(origin)),
      capacity_(static_cast<std::size_t>(std::max(1, capacity))) {
  for (int i = 0; i < std::max(1, threads); ++i) threads_.emplace_back([this] { work(); });
}

bool Writer::submit(Job job) {
  std::unique_lock lock(mutex_);
  room_.wait(lock, [this] { return queue_.size() < capacity_ || fatal_; });
  if (fatal_) return false;
  queue_.push_back(std::move(job));
  work_.notify_one();
  return true;
}

void Writer::close() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    work_.notify_all();
  }
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
}

bool Writer::failed() {
  const std::scoped_lock lock(mutex_);
  return fatal_ != nullptr || !failures_.empty();
}

void Writer::rethrow() {
  if (fatal_) std::rethrow_exception(fatal_);
}

void Writer::work() {
  // On Linux that of this thread alone; what cannot be had is no loss
  [[maybe_unused]] const int niceness = ::nice(kWriterNiceness);
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      work_.wait(lock, [this] { return !queue_.empty() || closed_ || fatal_; });
      if (fatal_ || queue_.empty()) return;
      job = std::move(queue_.front());
      queue_.pop_front();
      room_.notify_one();
    }
    try {
      write(job);
      const std::scoped_lock lock(mutex_);
      written_.push_back(job.task->frame.number);
    } catch (const OutputError&) {
      // No room, no permission: the next frame would fare no better.
      const std::scoped_lock lock(mutex_);
      if (!fatal_) fatal_ = std::current_exception();
      room_.notify_all();
      work_.notify_all();
      return;
    } catch (const std::exception& error) {
      const std::scoped_lock lock(mutex_);
      failures_.emplace_back(job.task->frame.number, error);
    }
  }
}

void Writer::write(Job& job) {
  const int number = job.task->frame.number;
  const std::vector<EncodedFile> files = encode_(job.frame, job.task->frame);
  FrameRecord record;
  double writeSeconds = 0.0;
  for (const EncodedFile& file : files) {
    const std::int64_t start = nowNs();
    folder_.writeFile(file.path, file.bytes);
    writeSeconds += secondsSince(start);
    job.frame.samples.push_back({number, file.step, file.seconds, "overlapped", false});
    Fingerprint content;
    content.add(std::span<const std::byte>(file.bytes));
    record.files.push_back({file.path, file.bytes.size(), content.text()});
  }
  job.frame.samples.push_back({number, "write", writeSeconds, "overlapped", false});
  record.frame = number;
  record.timeSeconds = job.task->frame.timeSeconds;
  record.fingerprints = job.task->fingerprints;
  record.origin = origin_;
  record.counters = std::move(job.frame.counters);
  record.tables = std::move(job.frame.tables);
  record.samples = std::move(job.frame.samples);
  folder_.add(std::move(record));
}

}  // namespace catoptric::run
