// Frames at which a method with state starts anew, and what must be rendered before a frame that is
// none of them.
#pragma once

#include <vector>

#include "methods/contract/method.h"
#include "scene/camera.h"

namespace catoptric::methods {

/// Whether `number` is on the grid 1, 1 + every, 1 + 2 every, ...; `every` 0: frame 1 alone.
bool onRestartGrid(int number, int every);

/// Whether the camera jumps from frame number - 1 to frame `number` of the path: it moves or turns
/// by more than 10 times what it does in the frames beside.
bool cutsBefore(const scene::CameraPath& path, int number);

/// The frames `asked` for (ascending) and, before each, all frames of the path since its restart
/// frame: what has to be rendered, ascending.
std::vector<int> withWarmUp(const Method& method, const scene::CameraPath& path,
                            const std::vector<int>& asked);

}  // namespace catoptric::methods
