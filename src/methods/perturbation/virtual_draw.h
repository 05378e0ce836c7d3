// Draws virtual objects [Chen2000]: triangles with the attributes of the object, and the virtual
// position of each vertex.
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

/// The image of one object in a reflector or in a sequence of reflectors.
struct VirtualTriangles {
  int object = 0;  ///< id of the object that is shown
  /// A fragment is discarded if the sample's surface is farther (metres along the camera's axis)
  /// than this from the fragment's reflection point. Infinity: no fragment is discarded.
  float depthSlack = std::numeric_limits<float>::infinity();
  // Per vertex
  /// Positions on the object itself, and their attributes. Empty: `images` has the object's own
  /// vertices, which start at `firstVertex` of the geometry.
  std::vector<Vec3> positions;
  std::vector<frame::VertexAttributes> attributes;
  std::uint32_t firstVertex = 0;
  /// xyz: virtual position of the vertex in world space; w: |x - eye| / |image - eye|, where x is
  /// its reflection point on the line between them.
  std::vector<Vec4> images;
  /// For several reflectors: the last reflection point of each vertex, in world space. Empty for
  /// one reflector: the sample's own position takes its place.
  std::vector<Vec3> places;
  std::vector<std::uint32_t> indices;  ///< three per triangle, in any winding
};

/// Memory of a virtual object besides its vertices, its triangles and its screen tiles: six driver
/// buffers. Measured: 7.8 GB for a million objects of 4 vertices.
inline constexpr std::uint64_t kObjectBytes = 7168;
/// Memory of a vertex that a curved reflector shows: position, attributes, virtual position, last
/// reflection point.
inline constexpr std::uint64_t kVertexBytes =
    sizeof(Vec3) + sizeof(frame::VertexAttributes) + sizeof(Vec4) + sizeof(Vec3);
/// Memory of a vertex that `planes` planes show: position and attributes are the object's own, and
/// a single plane needs no reflection point.
constexpr std::uint64_t planarVertexBytes(std::size_t planes) {
  return sizeof(Vec4) + (planes > 1 ? sizeof(Vec3) : 0);
}
/// Memory of a triangle that may cover a sample: its indices and the samples.
inline constexpr std::uint64_t kTriangleBytes =
    3 * sizeof(std::uint32_t) + sizeof(raster::Rectangle);

/// VirtualTriangles on the GPU, for one camera.
struct VirtualObject {
  /// Rectangles refer to an image of width x height.
  VirtualObject(const VirtualTriangles& source, const raster::SceneGpu& scene,
                const scene::Camera& camera, int width, int height);

  /// Memory of its buffers, plus kObjectBytes.
  std::uint64_t bytes() const;

  int object = 0;
  /// The samples on which it is drawn have this value in VirtualPass::reflectors: an object id if
  /// the eye sees the reflector directly.
  std::uint32_t reflector = 0;
  /// The value that its own samples get for the draw of further reflections; 0: nothing is
  /// reflected in it.
  std::uint32_t next = 0;
  /// Index of refraction before its surface divided by the one behind it; 0: it reflects. Samples
  /// with total reflection get nextTotal.
  float refraction = 0.0f;
  std::uint32_t nextTotal = 0;
  float depthSlack = 0.0f;
  raster::Region where;                      ///< screen area that may show any part of it
  std::vector<raster::Rectangle> triangles;  ///< screen area of each of its triangles
  gl::Buffer positions;                      ///< empty if VirtualTriangles::positions is
  gl::Buffer attributes;                     ///< likewise
  gl::Buffer images;
  gl::Buffer places;  ///< empty if VirtualTriangles::places is
  gl::Buffer indices;
  gl::VertexArray vertices;
};

/// The inputs of one draw of virtual objects.
struct VirtualPass {
  const gl::Texture& reflectors;  ///< R32UI: the reflector number of each sample
  const gl::Texture& depth;       ///< reversed-Z depth of the reflectors' samples
  /// Writes what further reflections need: s to alpha of colour 0, the outgoing direction to colour
  /// 1, and `next` to colour 2.
  bool continues = false;
  bool fresnel = false;  ///< s follows Schlick's formula
  gl::StencilState stencil = {};
};

/// Draws the diffuse radiance of virtual objects into the bound framebuffer's colour 0 and depth
/// (reversed-Z, cleared by the caller), each on the samples of its reflector. The raster's
/// drawGBuffer() must have drawn this camera before. Nothing is drawn outside the rectangles
/// `parts` (in samples).
void drawVirtualObjects(raster::SceneRaster& raster, std::span<const VirtualObject* const> objects,
                        const VirtualPass& pass, const scene::Camera& camera,
                        const frame::Lighting& lighting, std::span<const raster::Rectangle> parts);

}  // namespace catoptric::methods::perturbation
