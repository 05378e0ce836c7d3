// Makes the plan of a run, with warnings.
#pragma once

#include "run/folder/plan.h"
#include "run/stage/stage.h"

namespace catoptric::app {

/// Makes the plan, and warns on stderr about items that are probably unwanted. Throws what methods
/// throw for scenes that they do not support.
run::Plan planOf(const run::Stage& stage);

}  // namespace catoptric::app
