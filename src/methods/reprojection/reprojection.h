// The method reprojection [Xie2017] traces reflections in a key frame and reprojects them in the
// following frames. Its mapping `surface` is the paper's baseline, image_warp.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& reprojectionEntry();

}  // namespace catoptric::methods
