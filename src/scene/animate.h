// The scene at one moment: node transforms and deformed vertices.
#pragma once

#include <vector>

#include "scene/scene.h"

namespace catoptric::scene {

struct Pose {
  double timeSeconds = 0.0;
  std::vector<Mat4> worldFromNode;               ///< one per node
  std::vector<std::vector<float>> morphWeights;  ///< one per node; empty where it has none
};

/// Evaluates all channels at `timeSeconds` (clamped to each channel's keys).
Pose poseAt(const Scene& scene, double timeSeconds);

/// Which objects' world-space vertices can change over time: an animated ancestor, skin or weights.
std::vector<bool> movingObjects(const Scene& scene);

/// Which objects can change their shape over time: moving weights of morph targets, or moving
/// joints.
std::vector<bool> deformingObjects(const Scene& scene);

/// Where an object's mesh is at `pose`; the identity for skinned objects, which follow their
/// joints.
Mat4 worldFromObject(const Scene& scene, const Object& object, const Pose& pose);

/// World-space vertices of one object: skinned, morphed, transformed. Arrays have one entry per
/// mesh vertex; tangents only when the mesh has them. A transform with negative determinant flips
/// the winding: see `flipWinding`.
struct WorldVertices {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  bool flipWinding = false;
};
WorldVertices worldVertices(const Scene& scene, const Object& object, const Pose& pose);

}  // namespace catoptric::scene
