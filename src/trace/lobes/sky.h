// The distance of the environment, where radiance fades with distance.
#pragma once

namespace catoptric::trace {

/// In metres (ours). With a finite one, a weak attenuation tends to none; the sky is black up to an
/// attenuation of 9 km.
constexpr float kSkyMetres = 1e6f;

}  // namespace catoptric::trace
