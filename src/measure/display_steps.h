// Display-referred steps 0..255, in which the papers state their errors.
#pragma once

namespace catoptric::measure {

/// The display step 0..255 of a scene-linear value: round(display8(value)); NaN gives 0.
int step8(float value);

}  // namespace catoptric::measure
