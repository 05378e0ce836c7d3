#include "run/sequence/tasks.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "methods/contract/restarts.h"

namespace catoptric::run {
namespace {

void addCamera(Fingerprint& fingerprint, const scene::PathFrame& frame) {
  fingerprint.addValue(frame.camera.worldFromCamera);
  fingerprint.addValue(frame.camera.verticalFovRad);
  fingerprint.addValue(frame.camera.nearMetres);
  fingerprint.addValue(frame.timeSeconds);
}

/// Why a frame cannot be re-used; empty when it can.
std::string whyAgain(const FrameTask& task, const RunFolder& folder, const std::string& renderer) {
  const int number = task.frame.number;
  std::string reason = folder.distrust(number, task.fingerprints);
  if (!reason.empty() || renderer.empty()) return reason;
  const std::string& known = folder.record(number)->origin.renderer;
  if (!sameRenderer(known, renderer)) reason = "it was made by " + known;
  return reason;
}

}  // namespace

std::vector<FrameTask> makeTasks(const scene::CameraPath& path, const std::vector<int>& asked,
                                 const methods::Method& method, const FrameFingerprints& common) {
  const std::set<int> wanted(asked.begin(), asked.end());
  std::vector<FrameTask> tasks;
  Fingerprint chain;
  for (const int number : methods::withWarmUp(method, path, asked)) {
    FrameTask task;
    task.frame = path.frame(number);
    task.restarts = number == 1 || method.restartsAt(path, number);
    task.asked = wanted.contains(number);
    task.fingerprints = common;
    if (task.restarts) chain = Fingerprint();
    addCamera(chain, task.frame);
    task.fingerprints.camera = chain.text();
    tasks.push_back(std::move(task));
  }
  return tasks;
}

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

std::vector<std::size_t> chunkBounds(const std::vector<FrameTask>& tasks, int count) {
  // Among the frames asked for, those that need no frame asked for before them.
  std::vector<std::size_t> starts;
  std::size_t frames = 0;
  bool restarted = true;
  for (const FrameTask& task : tasks) {
    restarted = restarted || task.restarts;
    if (!task.asked) continue;
    if (restarted) starts.push_back(frames);
    restarted = false;
    ++frames;
  }
  starts.push_back(frames);
  std::vector<std::size_t> bounds;
  for (int i = 0; i <= count; ++i) {
    const std::size_t even = frames * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
    const auto after = std::lower_bound(starts.begin(), starts.end(), even);
    const bool before =
        after != starts.begin() && *after != even && even - *(after - 1) <= *after - even;
    bounds.push_back(before ? *(after - 1) : *after);
  }
  return bounds;
}

std::vector<TaskPlan> planTasks(const std::vector<FrameTask>& tasks, const Chunk& chunk,
                                Existing existing, const RunFolder& folder,
                                const std::string& renderer, bool say) {
  std::vector<TaskPlan> plan(tasks.size());
  const std::vector<std::size_t> bounds = chunkBounds(tasks, chunk.count);
  const std::size_t begin = bounds[static_cast<std::size_t>(chunk.index) - 1];
  const std::size_t end = bounds[static_cast<std::size_t>(chunk.index)];
  std::map<std::string, std::vector<int>> again;
  std::size_t asked = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!tasks[i].asked) continue;
    const std::size_t place = asked++;
    if (place < begin || place >= end) continue;
    plan[i].outcome = TaskPlan::Outcome::Render;
    if (existing != Existing::Resume) continue;
    const int number = tasks[i].frame.number;
    const std::string reason = whyAgain(tasks[i], folder, renderer);
    std::error_code ignored;
    if (reason.empty()) {
      plan[i].outcome = TaskPlan::Outcome::Reuse;
    } else if (folder.record(number) != nullptr ||
               std::filesystem::exists(folder.path() / framePath("frames", number, ".exr"),
                                       ignored)) {
      again[reason].push_back(number);
    }
  }
  if (say)
    for (const auto& [reason, numbers] : again)
      log::info(folder.path().string() + (numbers.size() == 1 ? ": frame " : ": frames ") +
                scene::formatFrames(numbers) + (numbers.size() == 1 ? " is" : " are") +
                " rendered again: " + reason);
  bool needed = false;  // the task after this one needs its state
  for (std::size_t i = tasks.size(); i-- > 0;) {
    plan[i].run = plan[i].outcome == TaskPlan::Outcome::Render || needed;
    needed = plan[i].run && !tasks[i].restarts;
  }
  return plan;
}

std::vector<int> numbersOf(const std::vector<FrameTask>& tasks, const std::vector<TaskPlan>& plan,
                           TaskPlan::Outcome outcome) {
  std::vector<int> numbers;
  for (std::size_t i = 0; i < tasks.size(); ++i)
    if (plan[i].outcome == outcome) numbers.push_back(tasks[i].frame.number);
  return numbers;
}

std::vector<int> askedNumbers(const std::vector<FrameTask>& tasks) {
  std::vector<int> numbers;
  for (const FrameTask& task : tasks)
    if (task.asked) numbers.push_back(task.frame.number);
  return numbers;
}

void forgetStrangers(const std::vector<FrameTask>& tasks, RunFolder& folder) {
  std::map<int, const FrameTask*> known;
  for (const FrameTask& task : tasks) known[task.frame.number] = &task;
  std::map<std::string, std::vector<int>> strangers;  // by what is wrong with them
  for (const auto& [number, record] : folder.records()) {
    const auto task = known.find(number);
    if (task != known.end() && task->second->asked) continue;
    FrameFingerprints wanted = tasks.empty() ? record.fingerprints : tasks.front().fingerprints;
    // The camera of a frame that is no task is not known here; all else must agree.
    wanted.camera =
        task != known.end() ? task->second->fingerprints.camera : record.fingerprints.camera;
    const std::string reason = folder.distrust(number, wanted);
    if (reason.empty()) continue;
    strangers[reason].push_back(number);
  }
  for (const auto& [reason, numbers] : strangers) {
    log::warning(std::to_string(numbers.size()) + " frames of an earlier run (" +
                 scene::formatFrames(numbers) + ") are ignored: " + reason);
    for (const int number : numbers) folder.forget(number);
  }
}

}  // namespace catoptric::run
