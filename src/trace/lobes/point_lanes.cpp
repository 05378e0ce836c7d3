#include "trace/lobes/point_lanes.h"

#include <cmath>

#include "core/basis.h"
#include "core/vector_versions.h"

// The bodies below are plain loops over arrays that the compiler turns into vector code, once for
// each level of the machine (CMakeLists.txt: no errno, no traps). They repeat the operations of
// their scalar twins in reflect.cpp and methods/shared/sample_points.h one by one: equal bits.
namespace catoptric::trace {
namespace {

/// Whole vectors of the widest kind: what lies behind the last value is computed and never used.
constexpr std::size_t kWidest = 16;
static_assert(kMostLanes % kWidest == 0 && LobeLanes::kMost % kWidest == 0);

CATOPTRIC_INLINE std::size_t padded(std::size_t count) {
  return (count + kWidest - 1) / kWidest * kWidest;
}

CATOPTRIC_INLINE float larger(float a, float b) {
  return a < b ? b : a;
}

CATOPTRIC_INLINE void placeBody(const SampleCamera& camera, const SampleLanes& samples,
                                PointLanes& points) {
  const Mat3& m = camera.rayFromPixel;
  const float m00 = m[0][0], m01 = m[0][1], m02 = m[0][2];
  const float m10 = m[1][0], m11 = m[1][1], m12 = m[1][2];
  const float m20 = m[2][0], m21 = m[2][1], m22 = m[2][2];
  const float eyeX = camera.eye.x, eyeY = camera.eye.y, eyeZ = camera.eye.z;
  const float nearMetres = camera.nearMetres;
  const float* const sampleX = samples.x.data();
  const float* const sampleY = samples.y.data();
  const float* const depth = samples.depth.data();
  float* const positionX = points.position.x.data();
  float* const positionY = points.position.y.data();
  float* const positionZ = points.position.z.data();
  float* const directionX = points.direction.x.data();
  float* const directionY = points.direction.y.data();
  float* const directionZ = points.direction.z.data();
  float* const distance = points.distance.data();
  float* const coneDistance = points.coneDistance.data();
  const std::size_t count = padded(points.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float rayX = m00 * sampleX[i] + m10 * sampleY[i] + m20;
    const float rayY = m01 * sampleX[i] + m11 * sampleY[i] + m21;
    const float rayZ = m02 * sampleX[i] + m12 * sampleY[i] + m22;
    const float scale = nearMetres / depth[i];
    const float length = std::sqrt(rayX * rayX + rayY * rayY + rayZ * rayZ);
    positionX[i] = eyeX + scale * rayX;
    positionY[i] = eyeY + scale * rayY;
    positionZ[i] = eyeZ + scale * rayZ;
    directionX[i] = rayX / length;
    directionY[i] = rayY / length;
    directionZ[i] = rayZ / length;
    distance[i] = coneDistance[i] = scale * length;
  }
}

CATOPTRIC_INLINE void aimBody(PointLanes& points) {
  const float* const normalX = points.normal.x.data();
  const float* const normalY = points.normal.y.data();
  const float* const normalZ = points.normal.z.data();
  const float* const horizonX = points.lobeHorizon.x.data();
  const float* const horizonY = points.lobeHorizon.y.data();
  const float* const horizonZ = points.lobeHorizon.z.data();
  const float* const directionX = points.direction.x.data();
  const float* const directionY = points.direction.y.data();
  const float* const directionZ = points.direction.z.data();
  const float* const positionX = points.position.x.data();
  const float* const positionY = points.position.y.data();
  const float* const positionZ = points.position.z.data();
  const float* const extent = points.extent.data();
  const float* const distance = points.distance.data();
  float* const axisX = points.axis.x.data();
  float* const axisY = points.axis.y.data();
  float* const axisZ = points.axis.z.data();
  float* const originX = points.origin.x.data();
  float* const originY = points.origin.y.data();
  float* const originZ = points.origin.z.data();
  float* const above = points.above.data();
  const std::size_t count = padded(points.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    // glm::normalize(glm::reflect(direction, normal))
    const float cosine =
        normalX[i] * directionX[i] + normalY[i] * directionY[i] + normalZ[i] * directionZ[i];
    const float x = directionX[i] - normalX[i] * cosine * 2.0f;
    const float y = directionY[i] - normalY[i] * cosine * 2.0f;
    const float z = directionZ[i] - normalZ[i] * cosine * 2.0f;
    const float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
    axisX[i] = x * inverse;
    axisY[i] = y * inverse;
    axisZ[i] = z * inverse;
    above[i] = axisX[i] * horizonX[i] + axisY[i] * horizonY[i] + axisZ[i] * horizonZ[i];
    // surfaceOffset()
    const float largest = larger(larger(std::abs(positionX[i]), std::abs(positionY[i])),
                                 larger(std::abs(positionZ[i]), std::abs(distance[i])));
    const float offset =
        larger(kLeastOffset * extent[i], larger(largest * kRayOffset, kLeastRayOffset));
    originX[i] = positionX[i] + normalX[i] * offset;
    originY[i] = positionY[i] + normalY[i] * offset;
    originZ[i] = positionZ[i] + normalZ[i] * offset;
  }
}

/// A point's frame for its lobe, and where its rays go.
struct LobeFrame {
  Vec3 x, y, axis, horizon;
  float* directionX;
  float* directionY;
  float* directionZ;
};

CATOPTRIC_INLINE bool lobeBody(const LobeFrame& frame, const LobeLanes& lobe, std::size_t count) {
  const Vec3 bx = frame.x, by = frame.y, axis = frame.axis, h = frame.horizon;
  float* const directionX = frame.directionX;
  float* const directionY = frame.directionY;
  float* const directionZ = frame.directionZ;
  int below = 0;
  CATOPTRIC_INDEPENDENT
  for (std::size_t k = 0; k < count; ++k) {
    const float x = lobe.x[k] * bx.x + lobe.y[k] * by.x + lobe.z[k] * axis.x;
    const float y = lobe.x[k] * bx.y + lobe.y[k] * by.y + lobe.z[k] * axis.y;
    const float z = lobe.x[k] * bx.z + lobe.y[k] * by.z + lobe.z[k] * axis.z;
    const float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
    directionX[k] = x * inverse;
    directionY[k] = y * inverse;
    directionZ[k] = z * inverse;
    const float above = directionX[k] * h.x + directionY[k] * h.y + directionZ[k] * h.z;
    below |= above < 0.0f ? 1 : 0;
  }
  return below == 0;
}

struct Versions {
  void (*place)(const SampleCamera&, const SampleLanes&, PointLanes&);
  void (*aim)(PointLanes&);
  bool (*lobe)(const LobeFrame&, const LobeLanes&, std::size_t);
};

// One set of functions for each level: a macro, as a function's target is an attribute.
// NOLINTBEGIN(bugprone-macro-parentheses): attributes take none
#define CATOPTRIC_VERSION(name, attributes)                                           \
  namespace name {                                                                    \
  attributes void place(const SampleCamera& c, const SampleLanes& s, PointLanes& p) { \
    placeBody(c, s, p);                                                               \
  }                                                                                   \
  attributes void aim(PointLanes& p) {                                                \
    aimBody(p);                                                                       \
  }                                                                                   \
  attributes bool lobe(const LobeFrame& f, const LobeLanes& l, std::size_t n) {       \
    return lobeBody(f, l, n);                                                         \
  }                                                                                   \
  constexpr Versions kVersions{place, aim, lobe};                                     \
  }

CATOPTRIC_EACH_VECTOR_LEVEL(CATOPTRIC_VERSION)
#undef CATOPTRIC_VERSION
// NOLINTEND(bugprone-macro-parentheses)

const Versions& versions() {
  return versionOf(base::kVersions, v2::kVersions, v3::kVersions, v4::kVersions);
}

}  // namespace

ReflectionPoint PointLanes::at(std::size_t i) const {
  return {position.at(i), normal.at(i),  direction.at(i),        glossiness[i],
          distance[i],    refraction[i], {shiftX[i], shiftY[i]}, object[i],
          extent[i],      bent[i] != 0,  lobeHorizon.at(i)};
}

void PointLanes::set(std::size_t i, const ReflectionPoint& point) {
  position.set(i, point.position);
  normal.set(i, point.normal);
  direction.set(i, point.direction);
  glossiness[i] = point.glossiness;
  distance[i] = coneDistance[i] = point.distance;
  refraction[i] = point.refraction;
  shiftX[i] = point.shift.x;
  shiftY[i] = point.shift.y;
  object[i] = point.object;
  extent[i] = point.extent;
  bent[i] = point.bent ? 1 : 0;
  lobeHorizon.set(i, point.lobeHorizon == Vec3(0.0f) ? point.normal : point.lobeHorizon);
}

void placePoints(const SampleCamera& camera, const SampleLanes& samples, PointLanes& points) {
  versions().place(camera, samples, points);
}

void aim(PointLanes& points) {
  versions().aim(points);
}

bool aimLobe(const PointLanes& points, std::size_t point, const LobeLanes& lobe, std::size_t count,
             Lanes3& directions, std::size_t first) {
  const Basis basis(points.axis.at(point));
  const LobeFrame frame{basis.x,
                        basis.y,
                        basis.z,
                        points.lobeHorizon.at(point),
                        directions.x.data() + first,
                        directions.y.data() + first,
                        directions.z.data() + first};
  return versions().lobe(frame, lobe, count);
}

}  // namespace catoptric::trace
