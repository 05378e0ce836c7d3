// The frames of one method's sequence: the requested frames, and those that only warm up its state.
#pragma once

#include <string>
#include <vector>

#include "methods/contract/method.h"
#include "run/folder/run_folder.h"
#include "scene/camera.h"

namespace catoptric::run {

struct FrameTask {
  scene::PathFrame frame;
  FrameFingerprints fingerprints;
  /// Whether its pixels are independent of earlier frames. If false, the task before it is that of
  /// the path's previous frame.
  bool restarts = true;
  bool asked = true;  ///< false: rendered only if a later frame needs its state
};

/// Makes the tasks of the requested frames `asked` (ascending) and of all frames that warm up the
/// method. `common`: the fingerprints that all frames share, without cameras. If a frame depends on
/// earlier frames, its fingerprint contains the cameras of all frames since its restart frame.
std::vector<FrameTask> makeTasks(const scene::CameraPath& path, const std::vector<int>& asked,
                                 const methods::Method& method, const FrameFingerprints& common);

/// A part of a sequence: number `index` (from 1) of `count`.
struct Chunk {
  int index = 1;
  int count = 1;
};
/// Parses "2/8". Throws UsageError.
Chunk parseChunk(const std::string& text);
/// The indices at which chunks begin among the requested frames, and one past the last frame:
/// `count` + 1 values. Chunks are contiguous. Without state, their sizes differ by at most one.
/// With state, the beginning of each chunk is moved to the nearest restart frame, so that no chunk
/// renders frames of another one; some chunks may be empty.
std::vector<std::size_t> chunkBounds(const std::vector<FrameTask>& tasks, int count);

/// The plan for one task.
struct TaskPlan {
  enum class Outcome { None, Reuse, Render };
  Outcome outcome = Outcome::None;  ///< None unless the frame is requested and in this chunk
  bool run = false;                 ///< whether the method renders it, to keep it or to warm up
};

/// Decides which frames are rendered: those of the chunk without a trusted record, and before them
/// the frames whose state they need. `renderer`: the present renderer; empty: not known yet. `say`:
/// whether to log what is rendered again and why.
std::vector<TaskPlan> planTasks(const std::vector<FrameTask>& tasks, const Chunk& chunk,
                                Existing existing, const RunFolder& folder,
                                const std::string& renderer, bool say);

/// The frame numbers of the tasks with this outcome.
std::vector<int> numbersOf(const std::vector<FrameTask>& tasks, const std::vector<TaskPlan>& plan,
                           TaskPlan::Outcome outcome);
/// The numbers of the requested frames.
std::vector<int> askedNumbers(const std::vector<FrameTask>& tasks);

/// Removes the records of frames that this run does not make, if their fingerprints (settings,
/// scene, program) differ from those of this run.
void forgetStrangers(const std::vector<FrameTask>& tasks, RunFolder& folder);

}  // namespace catoptric::run
