// Objects where a reflector shows them [Chen2000]: triangles with the attributes of the object's
// own and the place at which each vertex appears.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"
#include "gl/draw_state.h"
#include "gl/objects.h"
#include "raster/scene_raster.h"

namespace catoptric::methods::perturbation {

/// What one reflector, or several one after the other, show of one object.
struct VirtualTriangles {
  int object = 0;  ///< id of the object that is shown
  /// Metres along the camera's axis: samples whose surface is farther than that from the place at
  /// which a fragment was reflected do not show it. Infinity: all do.
  float depthSlack = std::numeric_limits<float>::infinity();
  // Per vertex
  std::vector<Vec3> positions;  ///< the real ones
  std::vector<frame::VertexAttributes> attributes;
  /// xyz: where the vertex appears, world space; w: |x - eye| / |image - eye|, x the place of its
  /// reflection on the line between them.
  std::vector<Vec4> images;
  /// By way of several reflectors: from where each vertex is seen (the place of its last
  /// reflection), world space. Else empty: from the sample's own place.
  std::vector<Vec3> places;
  std::vector<std::uint32_t> indices;  ///< three per triangle, any winding
};

/// What one virtual object takes beside its vertices, its triangles and the tiles that it may show
/// in (six buffers of the driver); ours, of 7.8 GB for a million objects of 4 vertices.
inline constexpr std::uint64_t kObjectBytes = 7168;
/// Of a vertex: its place, its attributes, its image, the place of its last reflection.
inline constexpr std::uint64_t kVertexBytes =
    sizeof(Vec3) + sizeof(frame::VertexAttributes) + sizeof(Vec4) + sizeof(Vec3);

/// Those triangles on the device, for one camera.
struct VirtualObject {
  /// Rectangles are of an image of width x height.
  VirtualObject(const VirtualTriangles& source, const scene::Camera& camera, int width, int height);

  /// Of its buffers, and what keeping an object costs besides.
  std::uint64_t bytes() const;

  int object = 0;
  /// The number that samples have which show it: an object's id where the eye sees the reflector.
  std::uint32_t reflector = 0;
  std::uint32_t next = 0;  ///< of samples that show what is reflected in it; 0: nothing is
  /// Index of refraction before its surface, divided by the one behind it; 0: it mirrors. Where it
  /// reflects totally, samples have nextTotal.
  float refraction = 0.0f;
  std::uint32_t nextTotal = 0;
  float depthSlack = 0.0f;
  raster::Region where;                      ///< what may show any of it
  std::vector<raster::Rectangle> triangles;  ///< ... and each of its triangles
  gl::Buffer positions;
  gl::Buffer attributes;
  gl::Buffer images;
  gl::Buffer places;  ///< empty without
  gl::Buffer indices;
  gl::VertexArray vertices;
};

/// One pass over virtual objects.
struct VirtualPass {
  const gl::Texture& reflectors;  ///< R32UI: numbers of the reflectors that samples show
  const gl::Texture& depth;       ///< reversed-Z: where samples show them
  bool continues = false;  ///< colour a is s; the direction onward goes to colour 1, `next` to 2
  bool fresnel = false;    ///< s by Schlick's formula
  gl::StencilState stencil = {};
};

/// Draws the diffuse radiance of virtual objects into the bound framebuffer's colour 0 and depth
/// (reversed-Z, cleared by the caller), each on the samples of its reflector. The raster's
/// drawGBuffer() with this camera came before. Nothing is drawn outside the rectangles `parts`, in
/// samples.
void drawVirtualObjects(raster::SceneRaster& raster, std::span<const VirtualObject* const> objects,
                        const VirtualPass& pass, const scene::Camera& camera,
                        const frame::Lighting& lighting, std::span<const raster::Rectangle> parts);

}  // namespace catoptric::methods::perturbation
