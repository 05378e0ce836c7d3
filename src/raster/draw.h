// What a draw of the scene is asked for: which objects, and which of their values.
#pragma once

#include <cstdint>
#include <vector>

#include "gl/objects.h"

namespace catoptric::raster {

/// Objects by id (index + 1).
class ObjectSet {
 public:
  ObjectSet() = default;  ///< all there are
  static ObjectSet only(std::vector<int> ids);
  static ObjectSet without(std::vector<int> ids);
  bool has(int id) const;

 private:
  std::vector<int> ids_;    ///< sorted
  bool complement_ = true;  ///< whether these are left out
};

/// By what objects do over time.
enum class Which : std::uint8_t { All, Still, Moving };

/// Values that a diffuse draw writes, each to the next colour attachment; all have alpha 1 on
/// surfaces. Depth goes to the depth attachment.
struct DiffuseOutputs {
  bool radiance = true;   ///< rgb diffuse radiance, before any factor 1 - s
  bool normal = false;    ///< xyz unit shading normal turned to the viewer
  bool specular = false;  ///< s, g, 0
};

struct DiffuseDraw {
  ObjectSet objects = {};
  DiffuseOutputs outputs = {};
  /// Whether the environment is drawn where nothing is, with alpha 0; that takes radiance alone as
  /// output. Else the attachments stay there as the caller has cleared them.
  bool background = true;
  /// Whether closed opaque objects about the eye show their insides.
  bool insides = true;
  /// Depths of this view: surfaces are drawn that lie behind them, the nearest of those alone.
  const gl::Texture* behind = nullptr;
};

/// Counts of one pass.
struct DrawStatistics {
  std::uint64_t triangles = 0;  ///< submitted after culling
  std::uint64_t culledTriangles = 0;
};

}  // namespace catoptric::raster
