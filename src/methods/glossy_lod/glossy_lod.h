// The method glossy_lod: glossy ray tracing on geometry images with adaptive level of detail
// [Yu2008].
#pragma once

#include "methods/contract/method.h"

namespace catoptric::methods {

const MethodEntry& glossyLodEntry();

}  // namespace catoptric::methods
