// The frames of one method's sequence: those asked for, and those that only warm its state up.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "run/folder/run_folder.h"
#include "scene/camera.h"

namespace catoptric::run {

/// One frame of the sequence.
struct FrameTask {
  scene::PathFrame frame;
  FrameFingerprints fingerprints;
  /// Its pixels do not depend on earlier frames. Otherwise the task before is that of the path's
  /// frame before.
  bool restarts = true;
  bool asked = true;  ///< false: rendered only where a later frame needs its state
};

/// Tasks of the frames `asked` for (ascending), with all frames that warm the method up.
/// `common`: fingerprints of all frames, without cameras. A frame with a history has the cameras of
/// all frames of the path since its restart frame in its fingerprint.
std::vector<FrameTask> makeTasks(const scene::CameraPath& path, const std::vector<int>& asked,
                                 const methods::Method& method, const FrameFingerprints& common);

/// Part of a sequence: 1-based `index` of `count`.
struct Chunk {
  int index = 1;
  int count = 1;
};
/// Parses "2/8". Throws UsageError.
Chunk parseChunk(const std::string& text);
/// Where chunks begin among the frames asked for, and one past the last of them: `count` + 1
/// places. Chunks are contiguous; without state their sizes differ by at most one. With state each
/// begins at the restart frame nearest to that, so that none renders frames of another one, and
/// some may be empty.
std::vector<std::size_t> chunkBounds(const std::vector<FrameTask>& tasks, int count);

/// What becomes of one task.
struct TaskPlan {
  enum class Outcome { None, Reuse, Render };
  Outcome outcome = Outcome::None;  ///< of frames asked for in this chunk
  bool run = false;                 ///< the method renders it: to be kept, or to warm up
};

/// Which frames are rendered: those of the chunk without a trusted record, and before them those
/// whose state they need. `renderer`: what makes frames now; empty: not known yet. `say`: logs what
/// is rendered again and why.
std::vector<TaskPlan> planTasks(const std::vector<FrameTask>& tasks, const Chunk& chunk,
                                Existing existing, const RunFolder& folder,
                                const std::string& renderer, bool say);

/// Numbers of the tasks with this outcome.
std::vector<int> numbersOf(const std::vector<FrameTask>& tasks, const std::vector<TaskPlan>& plan,
                           TaskPlan::Outcome outcome);
/// Numbers of the frames asked for.
std::vector<int> askedNumbers(const std::vector<FrameTask>& tasks);

/// Records of frames that this run does not make stay only where they agree with it.
void forgetStrangers(const std::vector<FrameTask>& tasks, RunFolder& folder);

}  // namespace catoptric::run
