// Rays that leave a reflective object, and the object's own geometry image. The image is coarser
// than the surface that the rays leave: in one place it lies above the surface, in another below.
#pragma once

#include <array>
#include <cstddef>

#include "frame/geometry.h"
#include "methods/glossy_lod/scene_images.h"
#include "methods/glossy_lod/tree/traversal.h"
#include "trace/lobes/point_lanes.h"

namespace catoptric::methods::glossy_lod {

/// A point on an object, and the object's image there.
struct LeftPoint {
  Vec3 position;
  float apart;  ///< distance between surface and image, metres
  bool back;    ///< rays leave the back of the surface
};

/// Describes the points in `left`, and moves each point that lies below the image of its own object
/// up to the image, so that no ray slips away below the image. Adds to `visits`.
void liftOntoImages(const SceneImages& images, const TreeView& tree, trace::PointLanes& points,
                    LeftPoint* left, Visits& visits);

/// As traverse(), but rays pass self-hits: hits near their origin that only the image of their own
/// object has, not its surface. `left`: the point that each ray leaves.
void traverseFrom(const std::array<LeftPoint, RayPacket::kMost>& left, const SceneImages& images,
                  const frame::Geometry& geometry, const TreeView& tree, const RayPacket& packet,
                  float alpha, Levels levels, PacketHits& hits, Visits& visits);

}  // namespace catoptric::methods::glossy_lod
