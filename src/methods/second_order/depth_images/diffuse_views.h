// Draws many diffuse images in few passes. The CPU culls all views at once, triangle by triangle;
// then each object is drawn into all views of a layer.
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
  /// Right-handed, reversed-Z without a far plane, origin in the upper left corner.
  Mat4 clipFromWorld{1.0f};
  Vec3 eye{0.0f};
  float texelSpreadRad = 0.0f;  ///< angle that one texel subtends
  float nearestMetres = 0.0f;   ///< nothing nearer to the eye is drawn
  /// Triangles entirely beyond dot(farClip, (p, 1)) = 0 need not be drawn.
  Vec4 farClip{0.0f, 0.0f, 0.0f, 1.0f};
  /// Allowed error of levels of detail if an object's light has full weight; 0: always the finest.
  /// Objects smaller than half of it are left out.
  float levelErrorTexels = 0.0f;
  float shown = 1.0f;  ///< weight of the image's light; dim images allow larger errors
  int layer = 0;       ///< index of the framebuffer; x to height: rectangle in it
  int x = 0;
  int y = 0;
  int width = 1;
  int height = 1;
  /// Id of the object behind whose surface the eye lies; 0: none. Only its faces towards the eye
  /// are drawn. skipOwn: the object is not drawn at all.
  int ownObject = 0;
  bool skipOwn = false;
  bool ownBacks = false;                 ///< also draw the own object's faces that are turned away
  bool peel = false;                     ///< also draw a second layer
  Vec4 ownClip{0.0f, 0.0f, 0.0f, 1.0f};  ///< clips the own object to dot(ownClip, (p, 1)) > 0
};

/// The targets of views.
struct ViewLayers {
  /// Their depth must be cleared; cleared values remain where nothing is drawn.
  std::span<const gl::Framebuffer> targets;
  /// The array texture with the depth of `targets`. If views ask for a second layer, its second
  /// half stores the nearest surfaces behind the first ones. Null: no second layers.
  const gl::Texture* peeled = nullptr;
  bool compound = false;  ///< one draw call sends an object's triangles to all views of a layer
};

/// What limits the levels of detail, summed over all views.
struct DetailCounts {
  std::uint64_t leftOut = 0;  ///< objects too small to be visible
  std::uint64_t byShape = 0;  ///< not drawn coarser because of the next level's error in position
  std::uint64_t byLight = 0;  ///< not drawn coarser because of the next level's error in light

  void add(const DetailCounts& other) {
    leftOut += other.leftOut;
    byShape += other.byShape;
    byLight += other.byLight;
  }
};

class DiffuseViews {
 public:
  /// Draws diffuse radiance (colour 0) and depth of all views, each into its rectangle; views are
  /// sorted by layer. Skips triangles that are certainly invisible and levels of detail finer than
  /// a view needs. `geometry`: that of the scene's last update(). `triangles[i]` is set to the
  /// number drawn for views[i].
  DetailCounts draw(raster::SceneGpu& scene, std::span<const DiffuseView> views,
                    const ViewLayers& layers, const frame::Geometry& geometry,
                    const frame::Lighting& lighting, std::span<std::uint64_t> triangles);

 private:
  friend class ViewDraws;

  gl::VertexArray vertices_;
  gl::VertexArray compoundVertices_;
  gl::Buffer blocks_;
  gl::Buffer indices_;
  gl::Buffer commands_;  ///< draw commands; only for compound views, as is numbers_
  gl::Buffer numbers_;   ///< 0, 1, 2, ... for an attribute that counts instances
};

}  // namespace catoptric::methods::second_order
