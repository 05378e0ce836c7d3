#include "study/worker.h"

#include <time.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "config/json_text.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "image/image.h"
#include "methods/contract/keeps.h"
#include "run/folder/machine.h"
#include "run/folder/memory.h"
#include "run/sequence/session.h"
#include "run/stage/encoder.h"
#include "run/stage/method_source.h"

namespace catoptric::study {
namespace {

namespace fs = std::filesystem;

/// Of all threads of this process.
double cpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Fingerprint of R, G, B, which does not depend on how a file keeps them.
std::string pixelsOf(const image::Image& image) {
  std::vector<std::size_t> colours;
  for (const char* name : {"R", "G", "B"}) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    if (found != image.channels.end())
      colours.push_back(static_cast<std::size_t>(found - image.channels.begin()));
  }
  std::vector<float> values;
  values.reserve(image.pixelCount() * colours.size());
  for (std::size_t pixel = 0; pixel < image.pixelCount(); ++pixel)
    for (const std::size_t colour : colours)
      values.push_back(image.data[pixel * image.channels.size() + colour]);
  Fingerprint print;
  print.addArray(std::span<const float>(values));
  return print.text();
}

/// Seconds by step.
std::string stepsJson(const std::vector<frame::StepSample>& samples) {
  std::map<std::string, double> steps;
  for (const frame::StepSample& sample : samples) steps[sample.step] += sample.seconds;
  config::JsonText text;
  for (const auto& [step, seconds] : steps) text.add(step, seconds);
  return text.object();
}

/// The frames of one method, with what each needs of those before it.
class Frames {
 public:
  explicit Frames(run::Stage& stage)
      : made_(run::makeMethods(stage, methods::registry())),
        plan_(run::makePlan(stage.run(), stage.scene(), stage.environment(), stage.frames().size(),
                            made_)),
        source_(stage, *made_.front(), plan_.methods.front().needs),
        stage_(stage),
        frames_(stage.frames().begin(), stage.frames().end()),
        tasks_(makeTasks()),
        encode_(run::makeEncoder(stage.run(), stage.run().methods.front(), stage.scene().origin)) {
    run::requireMemory(plan_, run::obtainableMemory());
  }

  std::string ready() {
    stage_.buildGeometry();  // the scene's, with its light: no method's
    const std::int64_t start = nowNs();
    const double cpuStart = cpuSeconds();
    const std::vector<frame::StepSample> samples = source_.prepare();
    config::JsonText builds;
    builds.add("cpu_seconds", cpuSeconds() - cpuStart).add("seconds", secondsSince(start));
    double startup = 0.0;
    for (const frame::StepSample& sample : samples) startup += sample.seconds;
    std::string renderer = "CPU";
    const std::map<std::string, std::string> context = source_.context();
    if (context.contains("renderer")) renderer = context.at("renderer");
    return config::JsonText()
        .add("ready", true)
        .add("renderer", renderer)
        .add("build", run::buildFingerprint())
        .add("inputs", stage_.inputs().print())
        .add("startup_seconds", startup)
        .raw("startup", stepsJson(samples))
        .raw("builds", builds.object())
        .add("memory_bytes", run::peakMemory())
        .object();
  }

  std::string render(int number, bool first, const fs::path& writeTo) {
    std::size_t task = taskOf(number);
    if (first)
      while (!tasks_[task].restarts) --task;
    else if (last_ != task - 1 && !tasks_[task].restarts)
      warmUp(task);
    else if (writeTo.empty())
      renderNeighbour(task);

    const std::int64_t start = nowNs();
    const double cpuStart = cpuSeconds();
    run::RenderedFrame frame = renderTask(task, true);
    const double cpu = cpuSeconds() - cpuStart;
    const double seconds = secondsSince(start);

    config::JsonText answer;
    answer.add("frame", number)
        .add("seconds", seconds)
        .add("cpu_seconds", cpu)
        .raw("steps", stepsJson(frame.samples));
    if (!writeTo.empty()) {
      answer.add("pixels", pixelsOf(frame.image));
      for (const run::EncodedFile& file : encode_(frame, tasks_[task].frame)) {
        fs::create_directories((writeTo / file.path).parent_path());
        writeFileAtomically(writeTo / file.path, file.bytes);
      }
    }
    return answer.add("counters", frame.counters).add("memory_bytes", run::peakMemory()).object();
  }

 private:
  std::vector<run::FrameTask> makeTasks() const {
    return run::makeTasks(stage_, stage_.run().methods.front(), *made_.front(),
                          {frames_.begin(), frames_.end()});
  }

  /// The task of a frame of the run, or of another frame of its path.
  std::size_t taskOf(int number) {
    const auto found = [&] {
      return std::ranges::find(tasks_, number,
                               [](const run::FrameTask& task) { return task.frame.number; });
    };
    if (found() == tasks_.end()) {
      if (number < 1 || number > stage_.path().count())
        throw UsageError("the path has no frame " + std::to_string(number));
      frames_.insert(number);
      tasks_ = makeTasks();
      last_.reset();
    }
    return static_cast<std::size_t>(found() - tasks_.begin());
  }

  run::RenderedFrame renderTask(std::size_t task, bool kept) {
    // Whoever goes back to an earlier frame, or to the same one, must not re-use what stands still.
    const bool continues = (last_ && *last_ + 1 == task) || neighbour_;
    last_.reset();  // until it is made
    neighbour_ = false;
    run::RenderedFrame frame =
        source_.render({tasks_[task].frame, !continues, tasks_[task].restarts, kept});
    last_ = task;
    return frame;
  }

  /// The time of a frame is that of one in a sequence: renders the frame before it, where anything
  /// is kept from one to the next. Before the path's first frame that is the second one.
  void renderNeighbour(std::size_t task) {
    const scene::PathFrame& frame = tasks_[task].frame;
    if (last_ && tasks_[*last_].frame.number == frame.number - 1) return;
    const int number = frame.number > 1 ? frame.number - 1 : 2;
    if (number > stage_.path().count()) return;
    const scene::PathFrame before = stage_.path().frame(number);
    if (methods::keepsOf(*made_.front()).empty() && !(before.camera == frame.camera)) return;
    last_.reset();
    source_.render(
        {before, true, true, true});  // composited: a still camera's frame changes it in part
    neighbour_ = true;
  }

  /// Brings a method with a history to the state before `task`.
  void warmUp(std::size_t task) {
    std::size_t first = task;
    while (!tasks_[first].restarts) --first;
    for (std::size_t i = first; i < task; ++i) renderTask(i, false);
  }

  std::vector<std::unique_ptr<methods::Method>> made_;
  run::Plan plan_;
  run::MethodSource source_;
  run::Stage& stage_;
  std::set<int> frames_;
  std::vector<run::FrameTask> tasks_;
  run::Encoder encode_;
  std::optional<std::size_t> last_;  ///< task whose state the method has
  bool neighbour_ = false;           ///< renderNeighbour() has rendered the frame beside the next
};

}  // namespace

void serveFrames(run::Stage& stage, const std::function<bool(std::string&)>& next,
                 const std::function<void(const std::string&)>& answer) {
  if (stage.run().methods.size() != 1) throw UsageError("a worker renders by one method");
  Frames frames(stage);
  answer(frames.ready());
  for (std::string line; next(line);) {
    try {
      const config::Value order = config::parseText(line, "order");
      const fs::path writeTo = order.has("write") ? order.get("write").asString() : "";
      const bool first = order.has("first");
      answer(frames.render(static_cast<int>(order.get("frame").asInteger()), first, writeTo));
    } catch (const std::exception& error) {
      answer(config::JsonText().add("failed", error.what()).object());
    }
  }
}

}  // namespace catoptric::study
