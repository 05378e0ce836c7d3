// Built-in shapes: triangle meshes with exact normals and texture coordinates, wound outward.
// Metres, y up, centred at the origin unless stated otherwise. docs/scenes.md lists the parameters.
// All functions are pure. Parameters out of range are a bug of the caller (the description loader
// checks them first).
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "scene/implicit/surface.h"
#include "scene/scene.h"

namespace catoptric::scene {

/// The layout of texture coordinates: 0..1 over the shape (or each face), or in metres.
enum class UvMode { Unit, Metres };

// ---- shapes.cpp ----
Mesh makePlane(Vec2 size, glm::ivec2 segments, UvMode uv);

/// `faces`: which of the faces +x -x +y -y +z -z exist.
struct BoxShape {
  Vec3 size{1.0f};
  glm::ivec3 segments{1};
  bool inward = false;
  std::array<bool, 6> faces{true, true, true, true, true, true};
};
Mesh makeBox(const BoxShape& shape, UvMode uv);

/// A box whose edges and corners are rounded with `radius` (at most half of the smallest side).
Mesh makeRoundedBox(Vec3 size, float radius, int rounding, UvMode uv);

/// An upright wall that stands on y = 0 and faces +z, with rectangular openings (x, y of the lower
/// left corner, width, height). A wall with a thickness has a back at z = -thickness and reveals.
struct PanelShape {
  Vec2 size{1.0f};
  float thickness = 0.0f;
  std::vector<Vec4> openings;
  float cell = 0.0f;  ///< longest edge of the grid, metres; 0: only as fine as the openings need
};
Mesh makePanel(const PanelShape& shape, UvMode uv);

Mesh makeSphere(float radius, int around, int rows, UvMode uv);
/// A subdivided icosahedron. Its uv has a seam, and one pole vertex per triangle.
Mesh makeIcosphere(float radius, int level, UvMode uv);
Mesh makeTorus(float radius, float tube, int around, int aroundTube, UvMode uv);
Mesh makeDisk(float radius, float inner, int around, int rings, UvMode uv);
/// Stands on y = 0. A topRadius of 0 makes a cone.
Mesh makeCylinder(float radius, float topRadius, float height, int around, int up, bool caps,
                  UvMode uv);

// ---- curves.cpp ----
enum class ProfileCurve { Polyline, CatmullRom, Bezier, Polynomial };

/// A profile (r, y) that is turned about +y.
struct RevolutionShape {
  std::vector<Vec2> profile;        ///< from bottom to top; Bezier: 3k + 1 points
  std::vector<float> coefficients;  ///< Polynomial: r(y) = sum c_i y^i
  Vec2 range{0.0f, 1.0f};           ///< Polynomial: the range of y
  ProfileCurve curve = ProfileCurve::CatmullRom;
  float thickness = 0.0f;  ///< > 0: a vessel with an inner wall and a rim
  int around = 64;
  int along = 48;
  float smoothAngleRad = radians(40.0f);
  bool caps = true;
};
Mesh makeRevolution(const RevolutionShape& shape, UvMode uv);

struct TubeShape {
  std::vector<Vec3> points;
  std::vector<float> radii;  ///< one radius, or one per point
  bool smooth = true;        ///< a Catmull-Rom curve through the points
  bool closed = false;
  bool caps = true;
  int around = 16;
  int along = 8;  ///< rings per span
};
Mesh makeTube(const TubeShape& shape, UvMode uv);

/// A simple polygon in x and z, extruded upwards from y = 0.
Mesh makePrism(const std::vector<Vec2>& outline, float height, float bevel, UvMode uv);

Mesh makePolygons(const std::vector<Vec3>& vertices, const std::vector<std::vector<int>>& faces,
                  bool smooth, UvMode uv);

// ---- teapot.cpp ----
/// The Utah teapot of 32 Bezier patches [Newell1975]: y up, spout towards +x, standing on y = 0.
Mesh makeTeapot(float height, int segments, bool lid, UvMode uv);

// ---- implicit.cpp ----
/// A mesh by marching tetrahedra over the surface's domain. It is a manifold, closed except where
/// the domain cuts the surface off, with clean borders there. Vertices lie on the surface. Normals
/// are the gradients; where there is none, the mean normal of the adjacent triangles. `resolution`:
/// number of cells along the longest side. uv: a projection along the largest component of the
/// normal. The mesh keeps the surface (Mesh::surface). Throws SceneError, with what to do, if no
/// surface is found.
Mesh makeImplicit(const implicit::Surface& surface, int resolution, UvMode uv);

/// Profile curve (r, y) of a surface of revolution about +y, from bottom to top or closed. `scale`
/// is applied after turning.
struct ImplicitProfile {
  std::function<glm::dvec2(double)> at;  ///< the argument runs from 0 to 1
  glm::dvec3 scale{1.0};
};
/// As makeImplicit(), with a regular grid of `segments` (around, along) quads.
Mesh makeTurnedImplicit(const implicit::Surface& surface, const ImplicitProfile& profile,
                        const glm::ivec2& segments, UvMode uv);

/// Further surfaces that are defined by formulas.
implicit::Surface gyroidSurface(double period, double thickness, double radius);
implicit::Surface heartSurface();
implicit::Surface genus2Surface();
implicit::Surface blobbyCubeSurface();

// ---- morph.cpp ----
enum class MorphType { Wave, Flag, Bulge, Twist, Stretch };

/// Morph targets for a mesh. A cyclic wave takes two targets (sine and cosine).
struct MorphShape {
  MorphType type = MorphType::Wave;
  float amplitude =
      0.1f;            ///< Wave, Flag, Bulge: metres; Twist: turns; Stretch: a factor of the height
  float waves = 2.0f;  ///< along the longest extent
  Vec3 axis{0.0f, 1.0f, 0.0f};
};
/// Adds the targets to `mesh` and returns their number.
int addMorphTargets(Mesh& mesh, const MorphShape& shape);

/// The deformed position of a point. Tests compare morphed normals with its finite differences.
Vec3 morphedPosition(const MorphShape& shape, const Box3& bounds, int target, const Vec3& position);

}  // namespace catoptric::scene
