// What a run needs, with warnings.
#pragma once

#include "run/folder/plan.h"
#include "run/stage/stage.h"

namespace catoptric::app {

/// Makes the plan, and warns on stderr of what is likely to be unwanted. Throws what methods throw
/// of scenes that they do not accept.
run::Plan planOf(const run::Stage& stage);

}  // namespace catoptric::app
