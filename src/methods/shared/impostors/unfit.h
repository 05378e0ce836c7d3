// The reflectors whose reflections impostors show badly, whatever the view. The decision holds for
// the whole run.
#pragma once

#include <cstdint>
#include <vector>

#include "methods/shared/impostors/choice.h"

namespace catoptric::methods::impostors {

/// Why a reflector is unfit. Itself: it reflects much of itself, which the impostors of other
/// objects never show. Near: its billboards are far off, because objects are near and large.
enum class Unfit : std::uint8_t { No, Itself, Near };

/// The fraction of an object's lines of sight whose mirrored ray hits the object again: lines from
/// afar, in all directions, to points all over its surface. 0 for a convex object.
float selfReflection(const scene::Scene& scene, const frame::Geometry& geometry, int object);

/// By object; none in scenes with implicit surfaces, whose rays take long. `choice`: in the pose of
/// `geometry`; `reflects`: see choose().
std::vector<Unfit> unfitReflectors(const Options& options, const scene::Scene& scene,
                                   const frame::Geometry& geometry, const Choice& choice,
                                   const std::vector<bool>& reflects);

}  // namespace catoptric::methods::impostors
