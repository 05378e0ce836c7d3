// The scene at one moment in time: node transforms and deformed vertices.
#pragma once

#include <vector>

#include "scene/scene.h"

namespace catoptric::scene {

struct Pose {
  double timeSeconds = 0.0;
  std::vector<Mat4> worldFromNode;               ///< one per node
  std::vector<std::vector<float>> morphWeights;  ///< one per node; empty if the node has none
};

/// Evaluates all channels at `timeSeconds` (clamped to each channel's keys).
Pose poseAt(const Scene& scene, double timeSeconds);

/// Tells for each object whether its world-space vertices can change over time: through an animated
/// ancestor, skin or morph weights.
std::vector<bool> movingObjects(const Scene& scene);

/// Tells for each object whether its shape can change over time: through animated morph weights or
/// joints.
std::vector<bool> deformingObjects(const Scene& scene);

/// The transform of an object's mesh at `pose`. Identity for skinned objects.
Mat4 worldFromObject(const Scene& scene, const Object& object, const Pose& pose);

/// Whether a transform takes every body to a point or a line: nothing of it can be seen.
bool leavesNoArea(const glm::dmat3& worldFromObject);

/// The world-space vertices of one object after skinning, morphing and transforming. Arrays have
/// one entry per mesh vertex; tangents exist only if the mesh has them. A transform with negative
/// determinant flips the winding: see `flipWinding`.
struct WorldVertices {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  bool flipWinding = false;
};
WorldVertices worldVertices(const Scene& scene, const Object& object, const Pose& pose);

/// All vertices at time 0 in world space, without those of Scene::ground.
std::vector<Vec3> placesAtStart(const Scene& scene);

/// Their box.
Box3 boundsAtStart(const Scene& scene);

}  // namespace catoptric::scene
