// The options that several methods have: their help texts, and the names of Embree's policies.
#pragma once

#include "config/options.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods {

inline constexpr const char* kRaysHelp = "rays per sample on rough reflectors; mirrors take one";
inline constexpr const char* kBouncesHelp =
    "reflections along a path; the last surface shows only its diffuse component";
inline constexpr const char* kAttenuationHelp =
    "distance in metres along a reflected ray over which its radiance fades to 1/e; 0: no fading";
inline constexpr const char* kObjectsHelp =
    "objects that reflected rays can hit: all, or only non-reflective ones (diffuse)";
inline constexpr const char* kFaceSizeHelp = "texels along the edge of a cube map face";

inline constexpr auto kBvhPolicies =
    config::names<trace::BvhPolicy>({{"static", trace::BvhPolicy::Static},
                                     {"refit", trace::BvhPolicy::Refit},
                                     {"rebuild_low", trace::BvhPolicy::RebuildLow},
                                     {"rebuild_medium", trace::BvhPolicy::RebuildMedium}});
inline constexpr const char* kBvhHelp =
    "how Embree's BVH follows moving objects. refit: one per object, refitted; static: the same, "
    "or one for the whole scene if nothing moves. rebuild_low, rebuild_medium: rebuilt in every "
    "frame, at this quality";

}  // namespace catoptric::methods
