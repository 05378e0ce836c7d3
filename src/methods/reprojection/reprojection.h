// Methods reprojection and image_warp [Xie2017]: reflections of a traced key frame, found again in
// the frames after it.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& reprojectionEntry();
const MethodEntry& imageWarpEntry();

}  // namespace catoptric::methods
