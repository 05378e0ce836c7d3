#include "trace/lobes/point_lanes.h"

#include <cmath>

#include "core/basis.h"
#include "core/minmax.h"
#include "core/vector_versions.h"

// The bodies below are plain loops over arrays that the compiler turns into vector code, once for
// each level of the machine (CMakeLists.txt: no errno, no traps). They repeat the operations of
// their scalar twins in reflect.cpp and methods/shared/sample_points.h one by one: equal bits.
namespace catoptric::trace {
namespace {

static_assert(kMostLanes % kWidestVector == 0);

CATOPTRIC_INLINE void placeBody(const SampleCamera& camera, const SampleLanes& samples,
                                PointLanes& points) {
  const Mat3& m = camera.rayFromPixel;
  const float m00 = m[0][0], m01 = m[0][1], m02 = m[0][2];
  const float m10 = m[1][0], m11 = m[1][1], m12 = m[1][2];
  const float m20 = m[2][0], m21 = m[2][1], m22 = m[2][2];
  const Vec3 eye = camera.eye;
  const float nearMetres = camera.nearMetres;
  auto& [positionX, positionY, positionZ] = points.position;
  auto& [directionX, directionY, directionZ] = points.direction;
  const std::size_t count = wholeVectors(points.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float rayX = m00 * samples.x[i] + m10 * samples.y[i] + m20;
    const float rayY = m01 * samples.x[i] + m11 * samples.y[i] + m21;
    const float rayZ = m02 * samples.x[i] + m12 * samples.y[i] + m22;
    const float scale = nearMetres / samples.depth[i];
    const float length = std::sqrt(rayX * rayX + rayY * rayY + rayZ * rayZ);
    positionX[i] = eye.x + scale * rayX;
    positionY[i] = eye.y + scale * rayY;
    positionZ[i] = eye.z + scale * rayZ;
    directionX[i] = rayX / length;
    directionY[i] = rayY / length;
    directionZ[i] = rayZ / length;
    points.distance[i] = points.coneDistance[i] = scale * length;
  }
}

CATOPTRIC_INLINE void aimBody(PointLanes& points) {
  const auto& [normalX, normalY, normalZ] = points.normal;
  const auto& [directionX, directionY, directionZ] = points.direction;
  const auto& [positionX, positionY, positionZ] = points.position;
  const PointVectors& horizon = points.lobeHorizon;
  auto& [axisX, axisY, axisZ] = points.axis;
  const std::size_t count = wholeVectors(points.count);
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
    points.above[i] = axisX[i] * horizon.x[i] + axisY[i] * horizon.y[i] + axisZ[i] * horizon.z[i];
    // surfaceOffset()
    const float largest = larger(larger(std::abs(positionX[i]), std::abs(positionY[i])),
                                 larger(std::abs(positionZ[i]), std::abs(points.distance[i])));
    const float offset =
        larger(kLeastOffset * points.extent[i], larger(largest * kRayOffset, kLeastRayOffset));
    points.origin.x[i] = positionX[i] + normalX[i] * offset;
    points.origin.y[i] = positionY[i] + normalY[i] * offset;
    points.origin.z[i] = positionZ[i] + normalZ[i] * offset;
  }
}

/// Of a point with this axis and horizon of its lobe.
CATOPTRIC_INLINE bool phongBody(const Basis& basis, const Vec3& horizon, const LobeLanes& lobe,
                                std::size_t count, std::size_t first, PointVectors& directions) {
  const Vec3 bx = basis.x, by = basis.y, axis = basis.z, h = horizon;
  float* const directionX = directions.x.data() + first;
  float* const directionY = directions.y.data() + first;
  float* const directionZ = directions.z.data() + first;
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

/// Of a point with this frame and horizon of its GGX lobe.
CATOPTRIC_INLINE bool ggxBody(const GgxFrame& frame, const Vec3& horizon, const LobeLanes& disk,
                              std::size_t count, std::size_t first, PointVectors& directions,
                              Lane& weights, Lane& densities) {
  const Vec3 bx = frame.x, by = frame.y, bz = frame.z, h = horizon;
  const scene::GgxView view = frame.view;
  float* const directionX = directions.x.data() + first;
  float* const directionY = directions.y.data() + first;
  float* const directionZ = directions.z.data() + first;
  float* const weight = weights.data() + first;
  float* const density = densities.data() + first;
  int below = 0;
  CATOPTRIC_INDEPENDENT
  for (std::size_t k = 0; k < count; ++k) {
    const scene::GgxRay ray = scene::ggxRay(view, disk.x[k], disk.y[k]);
    const float x = ray.x * bx.x + ray.y * by.x + ray.z * bz.x;
    const float y = ray.x * bx.y + ray.y * by.y + ray.z * bz.y;
    const float z = ray.x * bx.z + ray.y * by.z + ray.z * bz.z;
    const float inverse = 1.0f / std::sqrt(x * x + y * y + z * z);
    directionX[k] = x * inverse;
    directionY[k] = y * inverse;
    directionZ[k] = z * inverse;
    weight[k] = ray.weight;
    density[k] = ray.density;
    const float above = directionX[k] * h.x + directionY[k] * h.y + directionZ[k] * h.z;
    below |= above < 0.0f || !(ray.weight > 0.0f) ? 1 : 0;
  }
  return below == 0;
}

}  // namespace

ReflectionPoint PointLanes::at(std::size_t i) const {
  return {position.at(i), normal.at(i),  direction.at(i),        {lobe[i]},
          distance[i],    refraction[i], {shiftX[i], shiftY[i]}, object[i],
          extent[i],      bent[i] != 0,  lobeHorizon.at(i)};
}

void PointLanes::set(std::size_t i, const ReflectionPoint& point) {
  position.set(i, point.position);
  normal.set(i, point.normal);
  direction.set(i, point.direction);
  lobe[i] = point.lobe.code;
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
  atVectorLevel<placeBody>(camera, samples, points);
}

void aim(PointLanes& points) {
  atVectorLevel<aimBody>(points);
}

bool aimPhong(const PointLanes& points, std::size_t point, const LobeLanes& lobe, std::size_t count,
              PointVectors& directions, std::size_t first) {
  return atVectorLevel<phongBody>(Basis(points.axis.at(point)), points.lobeHorizon.at(point), lobe,
                                  count, first, directions);
}

bool aimGgx(const PointLanes& points, std::size_t point, const LobeLanes& disk, std::size_t count,
            PointVectors& directions, Lane& weights, Lane& densities, std::size_t first) {
  const GgxFrame frame(points.normal.at(point), points.direction.at(point),
                       scene::Lobe{points.lobe[point]}.alpha());
  return atVectorLevel<ggxBody>(frame, points.lobeHorizon.at(point), disk, count, first, directions,
                                weights, densities);
}

}  // namespace catoptric::trace
