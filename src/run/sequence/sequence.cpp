#include "run/sequence/sequence.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "run/stage/stage.h"
#include "scene/camera.h"

namespace catoptric::run {
namespace {

/// By which writers are nicer than the threads that render (ours): where both want a processor
/// writers get about a quarter of it. Much less, and programs beside this one would starve them.
constexpr int kWriterNiceness = 5;

/// A rendered frame on its way to the disk.
struct Job {
  const FrameTask* task = nullptr;
  RenderedFrame frame;
};

/// Encodes and writes frames in threads of its own, behind a bounded queue.
class Writer {
 public:
  Writer(RunFolder& folder, const Encoder& encode, std::string renderer, int threads, int capacity)
      : folder_(folder),
        encode_(encode),
        renderer_(std::move(renderer)),
        capacity_(static_cast<std::size_t>(std::max(1, capacity))) {
    for (int i = 0; i < std::max(1, threads); ++i) threads_.emplace_back([this] { work(); });
  }
  ~Writer() { close(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Waits for room. False when a write has failed for good: nothing more is taken.
  bool submit(Job job) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [this] { return queue_.size() < capacity_ || fatal_; });
    if (fatal_) return false;
    queue_.push_back(std::move(job));
    work_.notify_one();
    return true;
  }

  /// Waits until all is written.
  void close() {
    {
      const std::scoped_lock lock(mutex_);
      closed_ = true;
      work_.notify_all();
    }
    for (std::thread& thread : threads_)
      if (thread.joinable()) thread.join();
  }

  bool failed() {
    const std::scoped_lock lock(mutex_);
    return fatal_ != nullptr || !failures_.empty();
  }
  void rethrow() {
    if (fatal_) std::rethrow_exception(fatal_);
  }
  /// After close().
  const std::vector<FailedFrame>& failures() const { return failures_; }
  const std::vector<int>& written() const { return written_; }

 private:
  void work() {
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
        failures_.push_back({job.task->frame.number, error.what()});
      }
    }
  }

  void write(Job& job) {
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
    record.renderer = renderer_;
    record.counters = std::move(job.frame.counters);
    record.tables = std::move(job.frame.tables);
    record.samples = std::move(job.frame.samples);
    folder_.add(std::move(record));
  }

  RunFolder& folder_;
  const Encoder& encode_;
  std::string renderer_;
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

/// What happens to one task of the sequence.
enum class Action { Skip, Reuse, WarmUp, Render };

/// Which frames are rendered: those of the chunk without a trusted record, and before them those
/// whose state they need.
std::vector<Action> planActions(const std::vector<FrameTask>& tasks, const SequenceOptions& options,
                                const RunFolder& folder, const std::string& renderer, bool say) {
  std::vector<Action> actions(tasks.size(), Action::Skip);
  const auto [begin, end] = chunkRange(tasks.size(), options.chunk);
  std::map<std::string, std::vector<int>> again;
  for (std::size_t i = begin; i < end; ++i) {
    const int number = tasks[i].frame.number;
    std::error_code ignored;
    actions[i] = Action::Render;
    if (options.existing != Existing::Resume) continue;
    std::string reason = folder.distrust(number, tasks[i].fingerprints);
    if (reason.empty() && !renderer.empty() && folder.record(number)->renderer != renderer)
      reason = "it was made by " + folder.record(number)->renderer;
    if (reason.empty()) {
      actions[i] = Action::Reuse;
    } else if (folder.record(number) != nullptr ||
               std::filesystem::exists(folder.path() / framePath("frames", number, ".exr"),
                                       ignored)) {
      again[reason].push_back(number);
    }
  }
  if (say)
    for (const auto& [reason, numbers] : again)
      log::info((numbers.size() == 1 ? "frame " : "frames ") + scene::formatFrames(numbers) +
                (numbers.size() == 1 ? " is" : " are") + " rendered again: " + reason);
  for (std::size_t i = end; i-- > 1;)
    if ((actions[i] == Action::Render || actions[i] == Action::WarmUp) && !tasks[i].mayStart &&
        actions[i - 1] != Action::Render)
      actions[i - 1] = Action::WarmUp;
  return actions;
}

int countOf(const std::vector<Action>& actions, Action action) {
  return static_cast<int>(std::count(actions.begin(), actions.end(), action));
}

/// Records of frames that this run does not make stay only where they agree with it.
void checkOtherRecords(const std::vector<FrameTask>& tasks, RunFolder& folder) {
  std::map<int, const FrameTask*> known;
  for (const FrameTask& task : tasks) known[task.frame.number] = &task;
  std::map<std::string, std::vector<int>> strangers;  // by what is wrong with them
  for (const auto& [number, record] : folder.records()) {
    if (known.count(number) != 0) continue;
    // The camera of a frame outside this run is not known here; all else must agree.
    FrameFingerprints wanted = tasks.empty() ? record.fingerprints : tasks.front().fingerprints;
    wanted.camera = record.fingerprints.camera;
    const std::string reason = folder.distrust(number, wanted);
    if (reason.empty()) continue;
    strangers[reason].push_back(number);
  }
  for (const auto& [reason, numbers] : strangers) {
    log::warning(std::to_string(numbers.size()) + " of an earlier run's frames (" +
                 scene::formatFrames(numbers) + ") left out: " + reason);
    for (const int number : numbers) folder.forget(number);
  }
}

}  // namespace

Chunk parseChunk(const std::string& text) {
  Chunk chunk;
  const std::size_t slash = text.find('/');
  const auto number = [&](std::size_t begin, std::size_t end, int& value) {
    const auto [at, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    return error == std::errc() && at == text.data() + end;
  };
  if (slash == std::string::npos || !number(0, slash, chunk.index) ||
      !number(slash + 1, text.size(), chunk.count) || chunk.count < 1 || chunk.index < 1 ||
      chunk.index > chunk.count)
    throw UsageError("--chunk: \"" + text +
                     "\" is not i/n with 1 <= i <= n, such as 2/8 for the second of eight chunks");
  return chunk;
}

std::pair<std::size_t, std::size_t> chunkRange(std::size_t tasks, const Chunk& chunk) {
  const auto bound = [&](int i) {
    return tasks * static_cast<std::size_t>(i) / static_cast<std::size_t>(chunk.count);
  };
  return {bound(chunk.index - 1), bound(chunk.index)};
}

SequenceForecast forecastSequence(const std::vector<FrameTask>& tasks,
                                  const std::filesystem::path& path,
                                  const SequenceOptions& options) {
  RunFolder folder(path, options.existing, RunFolder::LookOnly{});
  if (options.existing == Existing::Resume) checkOtherRecords(tasks, folder);
  const std::vector<Action> actions = planActions(tasks, options, folder, "", true);
  SequenceForecast forecast;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const int number = tasks[i].frame.number;
    if (actions[i] == Action::Render) forecast.rendered.push_back(number);
    if (actions[i] == Action::Reuse) forecast.reused.push_back(number);
    if (actions[i] == Action::WarmUp) forecast.warmedUp.push_back(number);
  }
  return forecast;
}

SequenceResult runSequence(FrameSource& source, const std::vector<FrameTask>& tasks,
                           const std::filesystem::path& path, const SequenceOptions& options) {
  const std::int64_t runStart = nowNs();
  RunFolder folder(path, options.existing);
  if (options.existing == Existing::Resume) checkOtherRecords(tasks, folder);
  std::vector<Action> actions = planActions(tasks, options, folder, "", true);

  // Nothing is built when nothing is to be rendered.
  SequenceResult result;
  std::map<std::string, std::string> context;
  std::vector<FailedFrame> failures;
  Progress progress;
  const auto report = [&](int frame) {
    progress.frame = frame;
    progress.secondsElapsed = secondsSince(runStart);
    if (options.progress) options.progress(progress);
  };
  progress.toRender = countOf(actions, Action::Render);
  progress.reused = countOf(actions, Action::Reuse);
  report(0);
  std::map<std::string, std::string> members = options.summary;
  std::vector<int> wanted;
  for (const FrameTask& task : tasks) wanted.push_back(task.frame.number);
  members["sequence"] = config::JsonText()
                            .add("frames", scene::formatFrames(wanted))
                            .add("chunk", options.chunk.index)
                            .add("chunks", options.chunk.count)
                            .object();
  if (progress.toRender > 0) {
    // Said before the first frame, so that a killed run's folder tells what it was to hold.
    folder.writeSummary(members);
    try {
      folder.addStartup(source.prepare());
    } catch (const Stopped&) {
      result.stopped = true;
    } catch (...) {
      folder.discard();
      throw;
    }
  }
  if (progress.toRender > 0 && !result.stopped) {
    context = source.context();
    const std::string renderer = context.count("renderer") != 0 ? context.at("renderer") : "CPU";
    actions = planActions(tasks, options, folder, renderer, false);
    progress.toRender = countOf(actions, Action::Render);
    progress.reused = countOf(actions, Action::Reuse);
    for (std::size_t i = 0; i < tasks.size(); ++i)
      if (actions[i] == Action::Render) folder.forget(tasks[i].frame.number);
    folder.writeTimings();

    Writer writer(folder, options.encode, renderer, options.writerThreads, options.queueFrames);
    bool continues = false;  // the frame before this one was rendered just now
    bool ended = false;
    int rendered = 0;
    double waited = 0.0;
    const std::int64_t firstFrameStart = nowNs();
    std::int64_t frameStart = firstFrameStart;
    for (std::size_t i = 0; i < tasks.size() && !ended; ++i) {
      if (actions[i] == Action::Skip || actions[i] == Action::Reuse) {
        continues = false;
        continue;
      }
      if (options.stopRequested && options.stopRequested()) {
        result.stopped = true;
        break;
      }
      if (writer.failed() && !options.keepGoing) break;
      const int number = tasks[i].frame.number;
      const bool keep = actions[i] == Action::Render;
      Job job;
      job.task = &tasks[i];
      try {
        if (!continues && !tasks[i].mayStart && i > 0)
          throw Error(ExitCode::FramesFailed, "it needs the frame before it, which failed");
        job.frame = source.render(tasks[i].frame, !continues);
        continues = true;
      } catch (const std::exception& error) {
        log::error("frame " + std::to_string(number) + ": " + error.what());
        if (keep) failures.push_back({number, error.what()});
        continues = false;
        progress.failed = static_cast<int>(failures.size());
        ended = !options.keepGoing;
        frameStart = nowNs();
        continue;
      }
      if (!keep) {
        frameStart = nowNs();
        continue;
      }
      // Waiting for the writers before this frame is a step of this frame.
      if (waited > 0.0)
        job.frame.samples.push_back({number, "wait", waited, "wall", rendered == 0});
      waited = 0.0;
      // What no step names is `other`: time is never lost from the table.
      double named = 0.0;
      for (const frame::StepSample& sample : job.frame.samples)
        if (sample.clock != "overlapped") named += sample.seconds;
      const bool first = rendered == 0;
      const double whole = secondsSince(frameStart);
      job.frame.samples.push_back({number, "other", std::max(0.0, whole - named), "wall", first});
      frameStart = nowNs();
      const std::int64_t waitStart = nowNs();
      if (rendered == 0 && options.prepareEncoding) options.prepareEncoding();
      ended = !writer.submit(std::move(job));
      waited = secondsSince(waitStart);
      ++rendered;
      progress.done = rendered;
      progress.secondsLeft = secondsSince(firstFrameStart) / rendered *
                             (progress.toRender - rendered - progress.failed);
      report(number);
    }
    writer.close();
    failures.insert(failures.end(), writer.failures().begin(), writer.failures().end());
    result.rendered = writer.written();
    std::sort(result.rendered.begin(), result.rendered.end());
    writer.rethrow();
    folder.writeTimings();
  }

  for (std::size_t i = 0; i < tasks.size(); ++i)
    if (actions[i] == Action::Reuse) result.reused.push_back(tasks[i].frame.number);
  std::sort(failures.begin(), failures.end(),
            [](const FailedFrame& a, const FailedFrame& b) { return a.frame < b.frame; });
  result.failed = std::move(failures);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const int number = tasks[i].frame.number;
    if (actions[i] == Action::Render &&
        !std::binary_search(result.rendered.begin(), result.rendered.end(), number))
      result.missing.push_back(number);
  }
  if (!context.empty()) {
    config::JsonText device;
    for (const auto& [name, value] : context) device.add(name, value);
    members["device"] = device.object();
  }
  std::vector<int> failedNumbers;
  for (const FailedFrame& failed : result.failed) failedNumbers.push_back(failed.frame);
  members["status"] = config::JsonText()
                          .add("rendered", static_cast<int>(result.rendered.size()))
                          .add("reused", static_cast<int>(result.reused.size()))
                          .add("failed", failedNumbers)
                          .add("missing", result.missing)
                          .add("stopped", result.stopped)
                          .add("seconds", secondsSince(runStart))
                          .object();
  folder.writeTimings();
  folder.writeSummary(members);
  return result;
}

}  // namespace catoptric::run
