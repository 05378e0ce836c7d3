// The resident worker: a process that keeps one setting of one program ready and renders frames on
// request. It communicates by JSON lines.
//
// It prints {"ready": true, "startup": {step: seconds}, "builds": {"seconds", "cpu_seconds"}, ...}
// when it can render. It answers a line
// {"frame": 12} with {"frame": 12, "seconds": ..., "cpu_seconds": ..., "steps": {...}, "counters":
// {...}}. A frame is rendered right after the frame before it, which is rendered and dropped where
// that can save time (methods::keepsOf). With "first": true the answer is about the restart frame
// at or before it, as nothing was rendered before. With "write": "FOLDER" in the request, it writes
// the frame's files to that folder and adds a fingerprint of the pixels to the answer. It answers
// requests that fail with {"failed":
// "..."}. It ends when its input ends.
#pragma once

#include <functional>
#include <string>

#include "run/stage/stage.h"

namespace catoptric::study {

/// Serves the only method of the stage's run. `next` reads the next line and returns false at the
/// end of the input.
void serveFrames(run::Stage& stage, const std::function<bool(std::string&)>& next,
                 const std::function<void(const std::string&)>& answer);

}  // namespace catoptric::study
