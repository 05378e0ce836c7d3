// Frames at which a method with state restarts, and the frames that must be rendered before a frame
// that is not a restart frame.
#pragma once

#include <vector>

#include "methods/contract/method.h"
#include "scene/camera.h"

namespace catoptric::methods {

/// Whether `number` is one of 1, 1 + every, 1 + 2 every, ...; if `every` is 0, whether it is 1.
bool onRestartGrid(int number, int every);

/// Whether the camera jumps from frame number - 1 to frame `number` of the path: it moves or turns
/// more than 10 times as far as between the neighbouring frames.
bool cutsBefore(const scene::CameraPath& path, int number);

/// The frames that must be rendered to get the frames `asked` (ascending): these frames and, before
/// each of them, all frames of the path since its restart frame. The result is ascending.
std::vector<int> withWarmUp(const Method& method, const scene::CameraPath& path,
                            const std::vector<int>& asked);

}  // namespace catoptric::methods
