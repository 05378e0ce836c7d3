// Objects where a reflector shows them [Chen2000]: triangles with the attributes of the object's
// own and the place at which each vertex appears.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math.h"
#include "frame/geometry.h"
#include "gl/objects.h"
#include "raster/rectangle.h"

namespace catoptric::raster {

/// What one reflector shows of one object.
struct VirtualTriangles {
  int object = 0;     ///< id of the object that is shown
  int reflector = 0;  ///< id
  /// Metres along the camera's axis: samples whose surface is farther than that from the place at
  /// which a fragment was reflected do not show it. Infinity: all do.
  float depthSlack = std::numeric_limits<float>::infinity();
  // Per vertex
  std::vector<Vec3> positions;  ///< the real ones
  std::vector<frame::VertexAttributes> attributes;
  /// xyz: where the vertex appears, world space; w: |x - eye| / |image - eye|, x the place of its
  /// reflection on the line between them.
  std::vector<Vec4> images;
  std::vector<std::uint32_t> indices;  ///< three per triangle, any winding
};

/// Those triangles on the device, for one camera.
struct VirtualObject {
  /// Rectangles are of an image of width x height.
  VirtualObject(const VirtualTriangles& source, const scene::Camera& camera, int width, int height);

  int object = 0;
  int reflector = 0;
  float depthSlack = 0.0f;
  Rectangle where;                   ///< what may show any of it
  std::vector<Rectangle> triangles;  ///< ... and each of its triangles
  gl::Buffer positions;
  gl::Buffer attributes;
  gl::Buffer images;
  gl::Buffer indices;
  gl::VertexArray vertices;
};

}  // namespace catoptric::raster
