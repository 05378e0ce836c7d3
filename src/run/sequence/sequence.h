// The sequence runner: makes the frames of a run with a source that it knows by its interface
// alone, writes them behind the rendering, and keeps a run folder that can be resumed at any
// moment.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "frame/steps.h"
#include "image/image.h"
#include "methods/contract/table.h"
#include "run/folder/run_folder.h"
#include "run/sequence/tasks.h"
#include "scene/camera.h"

namespace catoptric::run {

struct RenderedFrame {
  image::Image image;
  std::map<std::string, std::uint64_t> counters;
  std::vector<methods::Table> tables;
  std::vector<frame::StepSample> samples;
};

/// What is asked of a source.
struct FrameRequest {
  scene::PathFrame frame;
  bool firstOfSequence = true;  ///< the frame before it was not rendered just now
  bool restarts = true;         ///< as in methods::FrameInput; true wherever firstOfSequence is
  bool kept = true;             ///< false: the result is thrown away, later frames need the state
};

/// Makes frames. One thread calls it.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Everything that is done once; called before the first frame, and not at all when no frame has
  /// to be rendered. Returns the samples of start-up (frame 0).
  virtual std::vector<frame::StepSample> prepare() = 0;
  /// Frames in the order of the path; between a restart frame and one that is kept none is missing.
  virtual RenderedFrame render(const FrameRequest& request) = 0;
  /// What is known after prepare() of where frames are made: "renderer", "processor" and the other
  /// members of FrameOrigin; "gl_version", ...
  virtual std::map<std::string, std::string> context() const { return {}; }
};

/// A file of a frame, ready to be written.
struct EncodedFile {
  std::string path;  ///< relative to the run's folder
  std::vector<std::byte> bytes;
  std::string step;  ///< "encode", "preview"
  double seconds = 0.0;
};

/// Called by writer threads; may add counters.
using Encoder = std::function<std::vector<EncodedFile>(RenderedFrame&, const scene::PathFrame&)>;

struct Progress {
  int done = 0;  ///< rendered in this process
  int toRender = 0;
  int reused = 0;
  int failed = 0;
  int frame = 0;  ///< the last frame, 0 while starting
  double secondsElapsed = 0.0;
  /// Of the frames still to render, from the mean of those done; negative when unknown.
  double secondsLeft = -1.0;
};

struct SequenceOptions {
  Chunk chunk;
  Existing existing = Existing::Error;
  bool keepGoing = false;
  double waitSeconds = 0.0;  ///< for another process that writes the folder
  int writerThreads = 2;
  int queueFrames = 3;                  ///< frames that wait to be written; rendering pauses beyond
  std::function<bool()> stopRequested;  ///< asked between frames
  std::function<void(const Progress&)> progress;
  Encoder encode;
  /// Further members of summary.json, JSON texts by name ("config", "plan", ...).
  std::map<std::string, std::string> summary;
};

struct FailedFrame {
  int frame = 0;
  std::string message;
};

struct SequenceResult {
  std::vector<int> rendered;
  std::vector<int> reused;
  std::vector<FailedFrame> failed;
  std::vector<int> missing;  ///< neither rendered nor reused, the failed ones included
  bool stopped = false;      ///< stopRequested() said so
};

/// What runSequence() would do, as far as that can be told before anything is made.
struct SequenceForecast {
  std::vector<int> rendered;
  std::vector<int> reused;    ///< of Resume: trusted, if the renderer is still the same
  std::vector<int> warmedUp;  ///< rendered for the state of later frames, and not kept;
                              ///< they may be re-used besides
};
/// Changes nothing. Throws what runSequence() would throw about the folder.
SequenceForecast forecastSequence(const std::vector<FrameTask>& tasks,
                                  const std::filesystem::path& path,
                                  const SequenceOptions& options);

/// Makes `tasks` in order, in the folder `path`. A frame that fails ends the run, unless
/// `keepGoing`; what was finished before stays valid. Frames that need the state of a failed one
/// warm up anew; where that fails too they fail, with the reason. Throws OutputError when files
/// cannot be written, and what prepare() throws.
SequenceResult runSequence(FrameSource& source, const std::vector<FrameTask>& tasks,
                           const std::filesystem::path& path, const SequenceOptions& options);

}  // namespace catoptric::run
