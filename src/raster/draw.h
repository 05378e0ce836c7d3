// Describes a draw of the scene: which objects are drawn, and which values are written.
#pragma once

#include <cstdint>
#include <vector>

#include "gl/objects.h"

namespace catoptric::raster {

/// A set of objects, given by their ids (index + 1).
class ObjectSet {
 public:
  ObjectSet() = default;  ///< all objects
  static ObjectSet only(std::vector<int> ids);
  static ObjectSet without(std::vector<int> ids);
  bool has(int id) const;

 private:
  std::vector<int> ids_;    ///< sorted
  bool complement_ = true;  ///< whether ids_ lists the objects that are not in the set
};

/// Selects objects by whether they ever move.
enum class Which : std::uint8_t { All, Still, Moving };

/// The values that a diffuse draw writes, each to the next colour attachment. Alpha is 1 on
/// surfaces. Depth is written to the depth attachment.
struct DiffuseOutputs {
  bool radiance = true;   ///< rgb: diffuse radiance, before any factor 1 - s
  bool normal = false;    ///< xyz: unit shading normal, turned towards the viewer
  bool specular = false;  ///< s, g, 0
  /// rgb: albedo / pi, alpha: visibility of the sky, by the formula of frame/shading.h. Radiance
  /// then has no sky and no lights.
  bool factors = false;
};

struct DiffuseDraw {
  ObjectSet objects = {};
  DiffuseOutputs outputs = {};
  /// Whether the environment is drawn where there is no surface, with alpha 0. Radiance must then
  /// be the only output. If false, the caller's clear values remain there.
  bool background = true;
  /// Whether closed opaque objects that contain the eye show their inner sides.
  bool insides = true;
  /// Optional depth texture of the same view, for depth peeling: only the nearest surfaces behind
  /// these depths are drawn.
  const gl::Texture* behind = nullptr;
};

/// Counts of one pass.
struct DrawStatistics {
  std::uint64_t triangles = 0;  ///< submitted after culling
  std::uint64_t culledTriangles = 0;
};

}  // namespace catoptric::raster
