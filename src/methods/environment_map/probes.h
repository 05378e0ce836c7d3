// Where the cube maps of environment_map stand if there are several.
#pragma once

#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"

namespace catoptric::methods {

/// Sorts reflectors (indices of objects) into at most `most` groups, each of which gets a map: as
/// long as there are fewer, the group whose members' middles lie farthest apart along an axis is
/// cut halfway along it. Members of one place stay together.
std::vector<std::vector<int>> groupReflectors(std::vector<int> reflectors,
                                              const frame::Geometry& geometry, int most);

/// Where the map of a group stands: in the middle of its box. A flat group's map is raised towards
/// the middle of the scene, for what lies on a floor or table would hide all else from it.
Vec3 probeCentre(std::span<const int> group, const frame::Geometry& geometry);

}  // namespace catoptric::methods
