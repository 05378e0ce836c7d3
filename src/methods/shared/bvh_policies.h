// The names of Embree's BVH policies in the options of methods that trace.
#pragma once

#include "config/options.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods {

inline constexpr auto kBvhPolicies =
    config::names<trace::BvhPolicy>({{"static", trace::BvhPolicy::Static},
                                     {"refit", trace::BvhPolicy::Refit},
                                     {"rebuild_low", trace::BvhPolicy::RebuildLow},
                                     {"rebuild_medium", trace::BvhPolicy::RebuildMedium}});

}  // namespace catoptric::methods
