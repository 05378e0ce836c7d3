// Display-referred values in steps 0..255, the unit in which the papers report errors.
#pragma once

namespace catoptric::measure {

/// The display step of a scene-linear value: round(display8(value)), 0..255; 0 for NaN.
int step8(float value);

}  // namespace catoptric::measure
