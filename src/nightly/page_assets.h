// The page's style and script, as the build embeds them.
#pragma once

namespace catoptric::nightly {

extern const char* const kPageStyle;
extern const char* const kPageScript;

}  // namespace catoptric::nightly
