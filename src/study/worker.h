// The resident worker: a process that holds one setting of one program ready and renders a frame
// when told, by JSON lines.
//
// It says {"ready": true, "startup": {step: seconds}, ...} when it can render. A line {"frame": 12}
// is answered by {"frame": 12, "seconds": ..., "cpu_seconds": ..., "steps": {...}, "counters":
// {...}}; with "write": "FOLDER" it writes the frame's files there, and the answer has a
// fingerprint of the pixels. What cannot be done is answered by {"failed": "..."}. It ends when its
// input ends.
#pragma once

#include <functional>
#include <string>

#include "run/stage/stage.h"

namespace catoptric::study {

/// Serves the only method of the stage's run. `next` gives the next line, false at the end.
void serveFrames(run::Stage& stage, const std::function<bool(std::string&)>& next,
                 const std::function<void(const std::string&)>& answer);

}  // namespace catoptric::study
