// Method reprojection [Xie2017]: reflections of a traced key frame, found again in the frames after
// it. Its mapping `surface` is the paper's control, image_warp.
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& reprojectionEntry();

}  // namespace catoptric::methods
