#include "trace/embree/implicit_geometry.h"

#include <cmath>

namespace catoptric::trace {
namespace {

using implicit::Domain;
using implicit::Point;

/// Halvings of the domain on the way to the pieces: a grid of 32^3; ours, like boundsOf().
constexpr int kDepth = 5;
/// Pieces overlap by this part of their size, so that rounding lets no ray through between them.
constexpr double kOverlap = 1e-6;

/// Boxes of the domain that interval arithmetic cannot free of the surface. A quadric is one: its
/// rays have a closed form.
std::vector<Domain> piecesOf(const implicit::Surface& surface) {
  if (surface.quadric) return {surface.domain};
  struct Cell {
    Domain box;
    int depth;
  };
  implicit::Evaluator<implicit::Interval> evaluate(surface.tape);
  std::vector<Cell> stack{{surface.domain, 0}};
  std::vector<Domain> pieces;
  while (!stack.empty()) {
    const Cell cell = stack.back();
    stack.pop_back();
    const auto side = [&](int axis) {
      return implicit::Interval{cell.box.min[axis], cell.box.max[axis]};
    };
    const implicit::Interval value = evaluate(side(0), side(1), side(2));
    if (value.undefined() || !value.containsZero()) continue;
    if (cell.depth == kDepth) {
      const Point margin = kOverlap * (cell.box.max - cell.box.min);
      pieces.push_back({cell.box.min - margin, cell.box.max + margin});
      continue;
    }
    const Point middle = 0.5 * (cell.box.min + cell.box.max);
    for (int octant = 7; octant >= 0; --octant) {
      Domain child = cell.box;
      for (int axis = 0; axis < 3; ++axis)
        (((octant >> axis) & 1) != 0 ? child.min : child.max)[axis] = middle[axis];
      stack.push_back({child, cell.depth + 1});
    }
  }
  return pieces;
}

/// A float on the safe side of a double.
float below(double x) {
  return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity());
}
float above(double x) {
  return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

struct Query {
  const scene::Mesh* mesh;
  ImplicitGeometry::Nearest* nearest;
};

/// Closest point of a triangle [Ericson2004, Sec. 5.1.5] as barycentric u, v.
glm::vec2 closestOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ap = p - a;
  const float d1 = glm::dot(ab, ap);
  const float d2 = glm::dot(ac, ap);
  if (d1 <= 0.0f && d2 <= 0.0f) return {0.0f, 0.0f};
  const Vec3 bp = p - b;
  const float d3 = glm::dot(ab, bp);
  const float d4 = glm::dot(ac, bp);
  if (d3 >= 0.0f && d4 <= d3) return {1.0f, 0.0f};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f && d1 > d3) return {d1 / (d1 - d3), 0.0f};
  const Vec3 cp = p - c;
  const float d5 = glm::dot(ab, cp);
  const float d6 = glm::dot(ac, cp);
  if (d6 >= 0.0f && d5 <= d6) return {0.0f, 1.0f};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f && d2 > d6) return {0.0f, d2 / (d2 - d6)};
  const float va = d3 * d6 - d5 * d4;
  const float e = d4 - d3;
  const float f = d5 - d6;
  if (va <= 0.0f && e >= 0.0f && f >= 0.0f && e + f > 0.0f) return {f / (e + f), e / (e + f)};
  const float sum = va + vb + vc;
  if (!(sum > 0.0f)) return {0.0f, 0.0f};
  return {vb / sum, vc / sum};
}

bool closerTriangle(RTCPointQueryFunctionArguments* arguments) {
  const auto* query = static_cast<const Query*>(arguments->userPtr);
  const std::uint32_t* t = &query->mesh->indices[3 * std::size_t{arguments->primID}];
  const Vec3 p(arguments->query->x, arguments->query->y, arguments->query->z);
  const Vec3& a = query->mesh->positions[t[0]];
  const Vec3& b = query->mesh->positions[t[1]];
  const Vec3& c = query->mesh->positions[t[2]];
  const glm::vec2 uv = closestOnTriangle(p, a, b, c);
  const float distance = glm::length(a + uv.x * (b - a) + uv.y * (c - a) - p);
  if (!(distance < arguments->query->radius)) return false;
  arguments->query->radius = distance;
  *query->nearest = {arguments->primID, uv.x, uv.y};
  return true;
}

}  // namespace

ImplicitGeometry::ImplicitGeometry(RTCDevice device, const scene::Mesh& mesh,
                                   const frame::PlacedSurface& placed, bool attributes)
    : mesh_(mesh), placed_(placed), pieces_(piecesOf(*mesh.surface)) {
  if (!attributes) return;
  positions_ = mesh.positions;
  positions_.emplace_back(0.0f);
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions_.data(), 0,
                             sizeof(Vec3), mesh.positions.size());
  rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                             3 * sizeof(std::uint32_t), mesh.indices.size() / 3);
  rtcCommitGeometry(g);
  triangles_ = rtcNewScene(device);
  rtcAttachGeometryByID(triangles_, g, 0);
  rtcReleaseGeometry(g);
  rtcCommitScene(triangles_);
}

ImplicitGeometry::~ImplicitGeometry() {
  if (triangles_ != nullptr) rtcReleaseScene(triangles_);
}

void ImplicitGeometry::attach(RTCGeometry geometry) {
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(pieces_.size()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, boundsFunction, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersectFunction);
  rtcSetGeometryOccludedFunction(geometry, occludedFunction);
}

Box3 ImplicitGeometry::boundsOfPiece(std::size_t piece) const {
  if (placed_.vanishedAt) {
    // A box, or a structure that is refitted later would be without the piece
    Box3 box;
    box.extend(*placed_.vanishedAt);
    return box;
  }
  const implicit::Affine& localFromWorld = placed_.surface.localFromWorld;
  const glm::dmat3 worldFromLocal = glm::inverse(localFromWorld.linear);
  const Domain& local = pieces_[piece];
  Domain world;
  for (int corner = 0; corner < 8; ++corner) {
    Point p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = (((corner >> axis) & 1) != 0 ? local.max : local.min)[axis];
    world.extend(worldFromLocal * (p - localFromWorld.offset));
  }
  Box3 box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = below(world.min[axis]);
    box.max[axis] = above(world.max[axis]);
  }
  return box;
}

Box3 ImplicitGeometry::bounds() const {
  Box3 box;
  for (std::size_t i = 0; i < pieces_.size(); ++i) box.extend(boundsOfPiece(i));
  return box;
}

float ImplicitGeometry::hitOf(std::size_t piece, const Vec3& origin, const Vec3& direction,
                              float tMin, float tMax) const {
  if (placed_.vanishedAt) return -1.0f;
  // The ray's part inside the piece; rounding is far below the overlap.
  const implicit::Surface& surface = placed_.surface;
  const Domain& box = pieces_[piece];
  const Point o = surface.localFromWorld(Point(origin));
  const Point d = surface.localFromWorld.linear * Point(direction);
  double begin = tMin;
  double end = tMax;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0.0) {
      if (o[axis] < box.min[axis] || o[axis] > box.max[axis]) return -1.0f;
      continue;
    }
    const double a = (box.min[axis] - o[axis]) / d[axis];
    const double b = (box.max[axis] - o[axis]) / d[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(begin <= end)) return -1.0f;
  const implicit::SurfaceHit hit =
      implicit::firstHit(surface, {Point(origin), Point(direction), begin, end});
  if (hit.status == implicit::HitStatus::Unresolved) ++unresolved_;
  if (hit.status != implicit::HitStatus::Hit) return -1.0f;
  const auto t = static_cast<float>(hit.t);
  return t >= tMin && t <= tMax ? t : -1.0f;
}

ImplicitGeometry::Nearest ImplicitGeometry::nearestTriangle(const Vec3& world) const {
  Nearest nearest;
  if (triangles_ == nullptr) return nearest;
  const Point local = placed_.surface.localFromWorld(Point(world));
  Query user{&mesh_, &nearest};
  RTCPointQuery query{};
  query.x = static_cast<float>(local.x);
  query.y = static_cast<float>(local.y);
  query.z = static_cast<float>(local.z);
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(triangles_, &query, &context, closerTriangle, &user);
  return nearest;
}

void ImplicitGeometry::boundsFunction(const RTCBoundsFunctionArguments* arguments) {
  const auto* self = static_cast<const ImplicitGeometry*>(arguments->geometryUserPtr);
  const Box3 box = self->boundsOfPiece(arguments->primID);
  RTCBounds& out = *arguments->bounds_o;
  out.lower_x = box.min.x;
  out.lower_y = box.min.y;
  out.lower_z = box.min.z;
  out.upper_x = box.max.x;
  out.upper_y = box.max.y;
  out.upper_z = box.max.z;
}

void ImplicitGeometry::intersectFunction(const RTCIntersectFunctionNArguments* arguments) {
  const auto* self = static_cast<const ImplicitGeometry*>(arguments->geometryUserPtr);
  const unsigned count = arguments->N;
  RTCRayN* ray = RTCRayHitN_RayN(arguments->rayhit, count);
  RTCHitN* hit = RTCRayHitN_HitN(arguments->rayhit, count);
  for (unsigned i = 0; i < count; ++i) {
    if (arguments->valid[i] != -1) continue;
    const Vec3 origin(RTCRayN_org_x(ray, count, i), RTCRayN_org_y(ray, count, i),
                      RTCRayN_org_z(ray, count, i));
    const Vec3 direction(RTCRayN_dir_x(ray, count, i), RTCRayN_dir_y(ray, count, i),
                         RTCRayN_dir_z(ray, count, i));
    const float t = self->hitOf(arguments->primID, origin, direction, RTCRayN_tnear(ray, count, i),
                                RTCRayN_tfar(ray, count, i));
    if (t < 0.0f) continue;
    RTCRayN_tfar(ray, count, i) = t;
    RTCHitN_u(hit, count, i) = 0.0f;
    RTCHitN_v(hit, count, i) = 0.0f;
    RTCHitN_primID(hit, count, i) = 0;
    RTCHitN_geomID(hit, count, i) = arguments->geomID;
    RTCHitN_instID(hit, count, i, 0) = RTC_INVALID_GEOMETRY_ID;
  }
}

void ImplicitGeometry::occludedFunction(const RTCOccludedFunctionNArguments* arguments) {
  const auto* self = static_cast<const ImplicitGeometry*>(arguments->geometryUserPtr);
  const unsigned count = arguments->N;
  for (unsigned i = 0; i < count; ++i) {
    if (arguments->valid[i] != -1) continue;
    RTCRayN* ray = arguments->ray;
    const Vec3 origin(RTCRayN_org_x(ray, count, i), RTCRayN_org_y(ray, count, i),
                      RTCRayN_org_z(ray, count, i));
    const Vec3 direction(RTCRayN_dir_x(ray, count, i), RTCRayN_dir_y(ray, count, i),
                         RTCRayN_dir_z(ray, count, i));
    const float t = self->hitOf(arguments->primID, origin, direction, RTCRayN_tnear(ray, count, i),
                                RTCRayN_tfar(ray, count, i));
    if (t >= 0.0f) RTCRayN_tfar(ray, count, i) = -std::numeric_limits<float>::infinity();
  }
}

}  // namespace catoptric::trace
