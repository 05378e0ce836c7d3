// Built-in shapes: triangle meshes with exact normals and texture coordinates, wound outward.
// Metres, y up, centred at the origin unless said otherwise; docs/scenes.md lists the parameters.
// All functions are pure; parameters out of their range are the caller's bug (the description
// loader checks them before).
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "scene/implicit/surface.h"
#include "scene/scene.h"

namespace catoptric::scene {

/// How texture coordinates are laid out: 0..1 over the shape (or each face), or in metres.
enum class UvMode { Unit, Metres };

// ---- shapes.cpp ----
Mesh makePlane(Vec2 size, glm::ivec2 segments, UvMode uv);

/// `faces`: which of +x -x +y -y +z -z are made.
struct BoxShape {
  Vec3 size{1.0f};
  glm::ivec3 segments{1};
  bool inward = false;
  std::array<bool, 6> faces{true, true, true, true, true, true};
};
Mesh makeBox(const BoxShape& shape, UvMode uv);

/// Edges and corners rounded with `radius` (at most half of the smallest side).
Mesh makeRoundedBox(Vec3 size, float radius, int rounding, UvMode uv);

/// An upright wall from y = 0 facing +z with rectangular openings (x, y of the lower left corner,
/// width, height); with a thickness it has a back at z = -thickness and reveals.
struct PanelShape {
  Vec2 size{1.0f};
  float thickness = 0.0f;
  std::vector<Vec4> openings;
  float cell = 0.0f;  ///< longest grid edge in metres; 0: only what the openings need
};
Mesh makePanel(const PanelShape& shape, UvMode uv);

Mesh makeSphere(float radius, int around, int rows, UvMode uv);
/// Subdivided icosahedron; uv has a seam and one pole vertex per triangle.
Mesh makeIcosphere(float radius, int level, UvMode uv);
Mesh makeTorus(float radius, float tube, int around, int aroundTube, UvMode uv);
Mesh makeDisk(float radius, float inner, int around, int rings, UvMode uv);
/// Stands on y = 0; topRadius 0 is a cone.
Mesh makeCylinder(float radius, float topRadius, float height, int around, int up, bool caps,
                  UvMode uv);

// ---- curves.cpp ----
enum class ProfileCurve { Polyline, CatmullRom, Bezier, Polynomial };

/// A profile (r, y) turned about +y.
struct RevolutionShape {
  std::vector<Vec2> profile;        ///< from bottom to top; Bezier: 3k + 1 points
  std::vector<float> coefficients;  ///< Polynomial: r(y) = sum c_i y^i
  Vec2 range{0.0f, 1.0f};           ///< Polynomial: y
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
  std::vector<float> radii;  ///< one, or one per point
  bool smooth = true;        ///< Catmull-Rom through the points
  bool closed = false;
  bool caps = true;
  int around = 16;
  int along = 8;  ///< rings per span
};
Mesh makeTube(const TubeShape& shape, UvMode uv);

/// A simple polygon in x and z, extruded from y = 0.
Mesh makePrism(const std::vector<Vec2>& outline, float height, float bevel, UvMode uv);

Mesh makePolygons(const std::vector<Vec3>& vertices, const std::vector<std::vector<int>>& faces,
                  bool smooth, UvMode uv);

// ---- teapot.cpp ----
/// The Utah teapot's 32 Bezier patches [Newell1975], y up, spout to +x, standing on y = 0.
Mesh makeTeapot(float height, int segments, bool lid, UvMode uv);

// ---- implicit.cpp ----
/// Marching tetrahedra over the surface's domain: a manifold, closed but where the domain cuts the
/// surface off, with clean rims there. Vertices lie on the surface, normals are its gradients
/// (where there is none, the mean of the triangles around). `resolution`: cells along the longest
/// side. uv: a projection along the largest axis of the normal. Throws SceneError, with what to do,
/// when nothing is found. The mesh keeps the surface (Mesh::surface).
Mesh makeImplicit(const implicit::Surface& surface, int resolution, UvMode uv);

/// A curve (r, y) that a surface about +y is the revolution of, from bottom to top or all around;
/// then scaled.
struct ImplicitProfile {
  std::function<glm::dvec2(double)> at;  ///< of 0 .. 1
  glm::dvec3 scale{1.0};
};
/// The same with a regular grid of `segments` (around, along) quads.
Mesh makeTurnedImplicit(const implicit::Surface& surface, const ImplicitProfile& profile,
                        const glm::ivec2& segments, UvMode uv);

/// Surfaces beyond implicit/surface.h: formulas.
implicit::Surface gyroidSurface(double period, double thickness, double radius);
implicit::Surface heartSurface();
implicit::Surface genus2Surface();
implicit::Surface blobbyCubeSurface();

// ---- morph.cpp ----
enum class MorphType { Wave, Flag, Bulge, Twist, Stretch };

/// Adds morph targets to a mesh; a cyclic wave takes two targets (sine and cosine).
struct MorphShape {
  MorphType type = MorphType::Wave;
  float amplitude = 0.1f;  ///< metres; Twist: turns; Stretch: a factor of the height
  float waves = 2.0f;      ///< along the longest extent
  Vec3 axis{0.0f, 1.0f, 0.0f};
};
/// Returns the number of targets that were added.
int addMorphTargets(Mesh& mesh, const MorphShape& shape);

/// What deforms a point; tests hold normals to its differences.
Vec3 morphedPosition(const MorphShape& shape, const Box3& bounds, int target, const Vec3& position);

}  // namespace catoptric::scene
