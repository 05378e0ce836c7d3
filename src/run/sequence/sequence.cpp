#include "run/sequence/sequence.h"

#include <algorithm>
#include <exception>
#include <optional>

#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/log.h"
#include "run/sequence/writer.h"
#include "run/stage/stage.h"

namespace catoptric::run {
namespace {

using Outcome = TaskPlan::Outcome;

/// One call of runSequence().
class Sequence {
 public:
  Sequence(FrameSource& source, const std::vector<FrameTask>& tasks,
           const std::filesystem::path& path, const SequenceOptions& options)
      : source_(source),
        tasks_(tasks),
        options_(options),
        folder_(path, options.existing, options.waitSeconds),
        members_(options.summary) {}

  SequenceResult run() {
    if (options_.existing == Existing::Resume) forgetStrangers(tasks_, folder_);
    plan("", true);
    report(0);
    members_["sequence"] = config::JsonText()
                               .add("frames", scene::formatFrames(askedNumbers(tasks_)))
                               .add("chunk", options_.chunk.index)
                               .add("chunks", options_.chunk.count)
                               .object();
    // Nothing is built when nothing is to be rendered.
    if (progress_.toRender == 0) folder_.begin();
    if (progress_.toRender > 0 && prepare()) write();
    finish();
    return std::move(result_);
  }

 private:
  void plan(const std::string& renderer, bool say) {
    plan_ = planTasks(tasks_, options_.chunk, options_.existing, folder_, renderer, say);
    progress_.toRender = static_cast<int>(numbersOf(tasks_, plan_, Outcome::Render).size());
    progress_.reused = static_cast<int>(numbersOf(tasks_, plan_, Outcome::Reuse).size());
    toRun_ = static_cast<int>(
        std::count_if(plan_.begin(), plan_.end(), [](const TaskPlan& task) { return task.run; }));
  }

  void report(int frame) {
    progress_.frame = frame;
    progress_.secondsElapsed = secondsSince(runStart_);
    if (options_.progress) options_.progress(progress_);
  }

  bool stopped() {
    result_.stopped = result_.stopped || (options_.stopRequested && options_.stopRequested());
    return result_.stopped;
  }

  /// False when the run was asked to stop.
  bool prepare() {
    // Said before the first frame, so that a killed run's folder tells what it was to hold. A run
    // that is to be overwritten stays whole until the device, the programs and the light are there.
    const bool replaces = folder_.holdsOldRun();
    if (!replaces) folder_.writeSummary(members_);
    try {
      folder_.addStartup(source_.prepare());
    } catch (const Stopped&) {
      result_.stopped = true;
      return false;
    } catch (...) {
      folder_.discard();
      throw;
    }
    folder_.begin();
    config::JsonText device;
    const std::map<std::string, std::string> context = source_.context();
    for (const auto& [name, value] : context) device.add(name, value);
    if (!context.empty()) members_["device"] = device.object();
    const auto text = [&](const char* name) {
      return context.contains(name) ? context.at(name) : "";
    };
    origin_ = {context.contains("renderer") ? text("renderer") : "CPU", text("processor"),
               text("instructions"), text("light")};
    if (replaces) folder_.writeSummary(members_);
    plan(origin_.renderer, false);
    Origins origins;
    for (const int number : numbersOf(tasks_, plan_, Outcome::Reuse))
      origins.add(folder_.record(number)->origin, number);
    for (const int number : numbersOf(tasks_, plan_, Outcome::Render)) {
      origins.add(origin_, number);
      folder_.forget(number);
    }
    origins.warn(folder_.path().string());
    folder_.writeTimings();
    return true;
  }

  /// Renders, behind that writes.
  void write() {
    Writer writer(folder_, options_.encode, origin_, options_.writerThreads, options_.queueFrames);
    firstFrameStart_ = frameStart_ = nowNs();
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (!plan_[i].run) {
        continues_ = false;
        continue;
      }
      if (stopped() || (writer.failed() && !options_.keepGoing) || !makeFrame(i, writer)) break;
    }
    writer.close();
    result_.failed.insert(result_.failed.end(), writer.failures().begin(), writer.failures().end());
    result_.rendered = writer.written();
    std::sort(result_.rendered.begin(), result_.rendered.end());
    if (warmUpSeconds_ > 0.0) folder_.addStartup({{0, "warm_up", warmUpSeconds_, "wall", false}});
    writer.rethrow();
  }

  /// Renders task i, and hands it to the writer where it is kept. False: the run ends.
  bool makeFrame(std::size_t i, Writer& writer) {
    const bool kept = plan_[i].outcome == Outcome::Render;
    if (tasks_[i].restarts) broken_.reset();
    if (!tasks_[i].restarts && !continues_ && !broken_) warmUpAgain(i);
    if (result_.stopped) return false;
    if (broken_) return !kept || fail(i, *broken_);

    Job job{&tasks_[i], {}};
    const std::optional<FailedFrame> failure = render(i, kept, job.frame);
    if (failure && kept) return fail(i, *failure);
    if (failure) broken_ = neededBy(*failure);
    if (!kept) {
      report(tasks_[i].frame.number);
      return true;
    }
    return submit(std::move(job), writer);
  }

  /// What went wrong, if something did.
  std::optional<FailedFrame> render(std::size_t i, bool kept, RenderedFrame& made) {
    const std::int64_t start = nowNs();
    std::optional<FailedFrame> failure;
    try {
      made = source_.render({tasks_[i].frame, !continues_, tasks_[i].restarts, kept});
      ++runs_;
    } catch (const std::exception& error) {
      if (options_.keepGoing)  // else it is the run's last word
        log::error("frame " + std::to_string(tasks_[i].frame.number) + ": " + messageOf(error));
      failure.emplace(tasks_[i].frame.number, error);
    }
    continues_ = !failure;
    if (!kept) warmUpSeconds_ += secondsSince(start);
    if (!kept || failure) frameStart_ = nowNs();
    return failure;
  }

  /// After a frame that failed: brings the method to the state before task i, which may need less
  /// than the frame itself did.
  void warmUpAgain(std::size_t i) {
    std::size_t first = i;
    while (!tasks_[first].restarts) --first;
    for (std::size_t j = first; j < i && !stopped(); ++j) {
      RenderedFrame unused;
      const std::optional<FailedFrame> failure = render(j, false, unused);
      if (!failure) continue;
      broken_ = neededBy(*failure);
      return;
    }
  }

  static FailedFrame neededBy(FailedFrame failure) {
    failure.message = "it needs frame " + std::to_string(failure.frame) +
                      " before it, which failed: " + failure.message;
    return failure;
  }

  /// True when the run goes on.
  bool fail(std::size_t i, FailedFrame failure) {
    failure.frame = tasks_[i].frame.number;
    result_.failed.push_back(std::move(failure));
    progress_.failed = static_cast<int>(result_.failed.size());
    return options_.keepGoing;
  }

  bool submit(Job job, Writer& writer) {
    const int number = job.task->frame.number;
    const bool first = progress_.done == 0;
    std::vector<frame::StepSample>& samples = job.frame.samples;
    // Waiting for the writers before this frame is a step of this frame.
    if (waited_ > 0.0) samples.push_back({number, "wait", waited_, "wall", first});
    // What no step names is `other`: time is never lost from the table.
    double named = 0.0;
    for (const frame::StepSample& sample : samples)
      if (sample.clock != "overlapped") named += sample.seconds;
    const double whole = secondsSince(frameStart_);
    samples.push_back({number, "other", std::max(0.0, whole - named), "wall", first});
    frameStart_ = nowNs();
    const std::int64_t waitStart = nowNs();
    const bool taken = writer.submit(std::move(job));
    waited_ = secondsSince(waitStart);
    ++progress_.done;
    progress_.secondsLeft =
        secondsSince(firstFrameStart_) / runs_ * std::max(0, toRun_ - runs_ - progress_.failed);
    report(number);
    return taken;
  }

  void finish() {
    result_.reused = numbersOf(tasks_, plan_, Outcome::Reuse);
    std::sort(result_.failed.begin(), result_.failed.end(),
              [](const FailedFrame& a, const FailedFrame& b) { return a.frame < b.frame; });
    for (const int number : numbersOf(tasks_, plan_, Outcome::Render))
      if (!std::binary_search(result_.rendered.begin(), result_.rendered.end(), number))
        result_.missing.push_back(number);
    std::vector<int> failed;
    for (const FailedFrame& frame : result_.failed) failed.push_back(frame.frame);
    members_["status"] = config::JsonText()
                             .add("rendered", static_cast<int>(result_.rendered.size()))
                             .add("reused", static_cast<int>(result_.reused.size()))
                             .add("failed", failed)
                             .add("missing", result_.missing)
                             .add("stopped", result_.stopped)
                             .add("seconds", secondsSince(runStart_))
                             .object();
    if (folder_.holdsOldRun()) return;  // stopped before it was replaced
    folder_.writeTimings();
    folder_.writeSummary(members_);
  }

  const std::int64_t runStart_ = nowNs();
  FrameSource& source_;
  const std::vector<FrameTask>& tasks_;
  const SequenceOptions& options_;
  RunFolder folder_;
  std::map<std::string, std::string> members_;  ///< of summary.json
  std::vector<TaskPlan> plan_;
  SequenceResult result_;
  Progress progress_;
  FrameOrigin origin_;
  int toRun_ = 0;                      ///< tasks that are rendered, warm-up included
  int runs_ = 0;                       ///< of these, done
  bool continues_ = false;             ///< the task before was rendered just now
  std::optional<FailedFrame> broken_;  ///< why frames until the next restart fail
  double waited_ = 0.0;
  double warmUpSeconds_ = 0.0;
  std::int64_t firstFrameStart_ = 0;
  std::int64_t frameStart_ = 0;
};

}  // namespace

FailedFrame::FailedFrame(int number, const std::exception& error)
    : frame(number), message(messageOf(error)), outOfMemory(isOutOfMemory(error)) {}

SequenceForecast forecastSequence(const std::vector<FrameTask>& tasks,
                                  const std::filesystem::path& path,
                                  const SequenceOptions& options) {
  RunFolder folder(path, options.existing, RunFolder::LookOnly{});
  if (options.existing == Existing::Resume) forgetStrangers(tasks, folder);
  const std::vector<TaskPlan> plan =
      planTasks(tasks, options.chunk, options.existing, folder, "", true);
  SequenceForecast forecast{
      numbersOf(tasks, plan, Outcome::Render), numbersOf(tasks, plan, Outcome::Reuse), {}};
  for (std::size_t i = 0; i < tasks.size(); ++i)
    if (plan[i].run && plan[i].outcome != Outcome::Render)
      forecast.warmedUp.push_back(tasks[i].frame.number);
  return forecast;
}

SequenceResult runSequence(FrameSource& source, const std::vector<FrameTask>& tasks,
                           const std::filesystem::path& path, const SequenceOptions& options) {
  return Sequence(source, tasks, path, options).run();
}

}  // namespace catoptric::run
