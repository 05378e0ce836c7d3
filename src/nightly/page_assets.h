// The page's style and script, embedded by the build.
#pragma once

namespace catoptric::nightly {

extern const char* const kPageStyle;
extern const char* const kPageScript;

}  // namespace catoptric::nightly
