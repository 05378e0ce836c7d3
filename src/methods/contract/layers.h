// The layers that a run asks for, and the masks.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

#include "methods/contract/method.h"
#include "raster/gbuffer.h"

namespace catoptric::methods {

/// Whether the run asks for this layer of RunSettings::layers.
inline bool asksFor(const RunSettings& settings, std::string_view layer) {
  return std::ranges::find(settings.layers, layer) != settings.layers.end();
}

/// A layer of MethodPlan::masks.
struct MaskInfo {
  int bit;  ///< raster::MaskBit
  const char* name;
  const char* meaning;  ///< samples that ...
};
inline constexpr std::array<MaskInfo, 14> kMasks = {{
    {raster::kMaskEnvironment, "mask.environment", "are shaded from the environment or a cube map"},
    {raster::kMaskDisoccluded, "mask.disoccluded", "reflect what the method has no image of"},
    {raster::kMaskClamped, "mask.clamped", "take their radiance from a texel above 65504"},
    {raster::kMaskRetraced, "mask.retraced", "were handed to the ray tracer"},
    {raster::kMaskBelowHorizon, "mask.below_horizon", "have a ray that would enter the surface"},
    {raster::kMaskSky, "mask.sky", "have a ray that left the scene"},
    {raster::kMaskTransition, "mask.transition", "have a ray that hits a virtual wall"},
    {raster::kMaskOffscreen, "mask.offscreen", "have a ray that leaves the frame"},
    {raster::kMaskBehind, "mask.behind", "have a ray that passes behind what the frame shows"},
    {raster::kMaskBackface, "mask.backface", "have a ray that meets the back of a surface"},
    {raster::kMaskTowardCamera, "mask.toward_camera", "have a ray that passes the eye"},
    {raster::kMaskSteps, "mask.steps", "have a ray that took all of its steps"},
    {raster::kMaskViewColour, "mask.view_colour", "have a ray that hits a reflector"},
    {raster::kMaskFallback, "mask.fallback", "are rendered by the method of `fallback`"},
}};

}  // namespace catoptric::methods
