// Many diffuse images in few passes: all views are culled at once on the CPU, triangle by triangle,
// then object after object is drawn into all views of a layer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "gl/objects.h"
#include "raster/scene_gpu/scene_gpu.h"

namespace catoptric::methods::second_order {

/// One of many diffuse images that are drawn together.
struct DiffuseView {
  Mat4 clipFromWorld{1.0f};  ///< right-handed, reversed-Z without a far plane, upper left
  Vec3 eye{0.0f};
  float texelSpreadRad = 0.0f;  ///< angle that one texel subtends
  float nearestMetres = 0.0f;   ///< nothing is drawn nearer to the eye
  /// What lies wholly beyond dot(farClip, (p, 1)) = 0 need not be drawn.
  Vec4 farClip{0.0f, 0.0f, 0.0f, 1.0f};
  /// Of levels of detail, where all of an object's light is shown; 0: always the finest. Objects of
  /// less than half as much are left out.
  float levelErrorTexels = 0.0f;
  float shown = 1.0f;  ///< share of its light that is shown; levels of what is dim err by more
  int layer = 0;       ///< which framebuffer, and the rectangle in it, row 0 on top
  int x = 0;
  int y = 0;
  int width = 1;
  int height = 1;
  /// Id of the object behind which the eye is: only its faces turned to the eye are drawn (0:
  /// none); and whether it is left out altogether.
  int ownObject = 0;
  bool skipOwn = false;
  bool ownBacks = false;                 ///< draw its faces that are turned away, too
  bool peel = false;                     ///< draw a second layer, too
  Vec4 ownClip{0.0f, 0.0f, 0.0f, 1.0f};  ///< ... and only where dot(ownClip, (p, 1)) > 0
};

/// Where views are drawn.
struct ViewLayers {
  /// Their depth has been cleared; where it stays, nothing was drawn.
  std::span<const gl::Framebuffer> targets;
  /// The array whose layers are the depth of `targets`, the second half of them for the nearest
  /// surfaces behind those of the first, where views ask for it; or null.
  const gl::Texture* peeled = nullptr;
  bool compound = false;  ///< one draw sends an object's triangles to all views of a layer
};

/// Buffers are kept from frame to frame.
/// What bounds the detail of objects, over all views.
struct DetailCounts {
  std::uint64_t leftOut = 0;  ///< objects that would be too small to show
  std::uint64_t byShape = 0;  ///< drawn no coarser, as the next level's places would show
  std::uint64_t byLight = 0;  ///< ... as its light would

  void add(const DetailCounts& other) {
    leftOut += other.leftOut;
    byShape += other.byShape;
    byLight += other.byLight;
  }
};

class DiffuseViews {
 public:
  /// Draws diffuse radiance (colour 0) and depth of all views, which are in the order of their
  /// layers, each into its rectangle. Triangles that certainly show nothing and levels of detail
  /// finer than a view asks for are not drawn. `geometry`: of the scene's last update().
  /// `triangles[i]`: drawn for views[i].
  DetailCounts draw(raster::SceneGpu& scene, std::span<const DiffuseView> views,
                    const ViewLayers& layers, const frame::Geometry& geometry,
                    const frame::Lighting& lighting, std::span<std::uint64_t> triangles);

 private:
  friend class ViewDraws;

  gl::VertexArray vertices_;
  gl::VertexArray compoundVertices_;
  gl::Buffer blocks_;
  gl::Buffer indices_;
  gl::Buffer commands_;  ///< of compound views, and the next
  gl::Buffer numbers_;   ///< 0, 1, 2, ... for an attribute that counts instances
};

}  // namespace catoptric::methods::second_order
