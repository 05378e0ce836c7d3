// The distance of the environment, where radiance fades with distance.
#pragma once

namespace catoptric::trace {

/// Distance in metres (our choice). It is finite, so that the sky fades little if the attenuation
/// length is far above it. With attenuation lengths up to 9 km the sky is black.
constexpr float kSkyMetres = 1e6f;

}  // namespace catoptric::trace
