// The sequence runner. A source, known only by its interface, renders the frames of a run. Threads
// write them in the background. The run folder can be resumed at any moment.
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

struct FrameRequest {
  scene::PathFrame frame;
  bool firstOfSequence = true;  ///< the previous frame of the path was not the last one rendered
  bool restarts = true;         ///< as in methods::FrameInput; true if firstOfSequence is true
  bool kept = true;  ///< false: the result is discarded; only the state for later frames matters
};

/// Renders frames. Only one thread calls it.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// One-time preparation, called before the first frame. Not called if no frame has to be
  /// rendered. Returns the times of start-up's steps.
  virtual std::vector<frame::StepSample> prepare() = 0;
  /// Renders a frame. Requests are in the order of the path. From a restart frame to a kept frame
  /// that depends on it, no frame is left out.
  virtual RenderedFrame render(const FrameRequest& request) = 0;
  /// Facts about the renderer that are known after prepare(): "renderer", "processor" and the other
  /// members of FrameOrigin; "gl_version", ...
  virtual std::map<std::string, std::string> context() const { return {}; }
};

/// A file of a frame that is ready to be written.
struct EncodedFile {
  std::string path;  ///< relative to the run's folder
  std::vector<std::byte> bytes;
  std::string step;  ///< "encode" or "preview"
  double seconds = 0.0;
};

/// Makes the files of a frame. Writer threads call it; it may add counters.
using Encoder = std::function<std::vector<EncodedFile>(RenderedFrame&, const scene::PathFrame&)>;

struct Progress {
  int done = 0;  ///< rendered in this process
  int toRender = 0;
  int reused = 0;
  int failed = 0;
  int frame = 0;  ///< the last frame; 0 while starting
  double secondsElapsed = 0.0;
  /// Estimated time of the remaining frames, from the mean of those that are done; negative if
  /// unknown.
  double secondsLeft = -1.0;
};

struct SequenceOptions {
  Chunk chunk;
  Existing existing = Existing::Error;
  bool keepGoing = false;
  double waitSeconds = 0.0;  ///< how long to wait for another process that writes to the folder
  int writerThreads = 2;
  int queueFrames = 3;  ///< maximum number of frames that wait to be written; rendering pauses then
  std::function<bool()> stopRequested;  ///< called between frames
  std::function<void(const Progress&)> progress;
  Encoder encode;
  /// Further members of summary.json: JSON texts by name ("config", "plan", ...).
  std::map<std::string, std::string> summary;
};

struct FailedFrame {
  FailedFrame(int number, const std::exception& error);

  int frame;
  std::string message;
  bool outOfMemory;
};

struct SequenceResult {
  std::vector<int> rendered;
  std::vector<int> reused;
  std::vector<FailedFrame> failed;
  std::vector<int> missing;  ///< neither rendered nor reused, including failed frames
  bool stopped = false;      ///< stopRequested() returned true
};

/// What runSequence() would do, as far as this is known before anything is rendered.
struct SequenceForecast {
  std::vector<int> rendered;
  std::vector<int>
      reused;  ///< with Resume: trusted frames, provided that the renderer is still the same
  std::vector<int> warmedUp;  ///< rendered only for the state of later frames, and discarded; a
                              ///< frame may also be listed in `reused`
};
/// Changes nothing. Throws what runSequence() would throw about the folder.
SequenceForecast forecastSequence(const std::vector<FrameTask>& tasks,
                                  const std::filesystem::path& path,
                                  const SequenceOptions& options);

/// Makes the frames of `tasks` in order, in the folder `path`. A failed frame ends the run, unless
/// `keepGoing` is set; frames that were finished before stay valid. If a later frame needs the
/// state of a failed frame, that state is warmed up anew. If the warm-up fails too, the later frame
/// fails with the reason. Throws OutputError if files cannot be written, and what prepare() throws.
SequenceResult runSequence(FrameSource& source, const std::vector<FrameTask>& tasks,
                           const std::filesystem::path& path, const SequenceOptions& options);

}  // namespace catoptric::run
