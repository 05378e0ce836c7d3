#include "methods/reprojection/cell_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/vector_versions.h"
#include "methods/reprojection/search.h"

// Plain loops that the compiler turns into vector code, once for each level of the machine, as in
// trace/lobes/point_lanes.cpp: equal bits.
namespace catoptric::methods::reprojection {
namespace {

static_assert(CellLanes::kMost % kWidestVector == 0);

/// The key frame's arrays.
struct KeyArrays {
  int width;
  float lastX, lastY;  ///< places of the last samples
  const std::uint32_t* cells;
  const float* places;    ///< 4 a sample
  const float* radiance;  ///< 3 a sample
};

CATOPTRIC_INLINE void moveBody(const KeyArrays& key, float near, CellLanes& lanes) {
  const std::size_t count = wholeVectors(lanes.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float px = lanes.x[i];
    const float py = lanes.y[i];
    const int inside = (px >= 0.0f ? 1 : 0) & (py >= 0.0f ? 1 : 0) & (px < key.lastX ? 1 : 0) &
                       (py < key.lastY ? 1 : 0);
    const int x = static_cast<int>(inside != 0 ? px : 0.0f);
    const int y = static_cast<int>(inside != 0 ? py : 0.0f);
    const float fx = px - static_cast<float>(x);
    const float fy = py - static_cast<float>(y);
    const int at = y * key.width + x;
    const std::uint32_t cell = key.cells[at];
    const float* const corner = key.places;
    const int a = 4 * at;
    const int c = 4 * (at + key.width);
    const float ax = corner[a], ay = corner[a + 1], az = corner[a + 2];
    const float topX = corner[a + 4] - ax, topY = corner[a + 5] - ay, topZ = corner[a + 6] - az;
    const float leftX = corner[c] - ax, leftY = corner[c + 1] - ay, leftZ = corner[c + 2] - az;
    const float twistX = corner[c + 4] - ax - topX - leftX;
    const float twistY = corner[c + 5] - ay - topY - leftY;
    const float twistZ = corner[c + 6] - az - topZ - leftZ;
    const float alongXx = topX + fy * twistX;
    const float alongXy = topY + fy * twistY;
    const float alongXz = topZ + fy * twistZ;
    const float alongYx = leftX + fx * twistX, alongYy = leftY + fx * twistY,
                alongYz = leftZ + fx * twistZ;
    const float from = (cell & 1U) != 0 ? 0.0f : 1.0f;  // the sky's places are directions
    const float wayX = ax + fx * alongXx + fy * leftX - from * lanes.origin.x[i];
    const float wayY = ay + fx * alongXy + fy * leftY - from * lanes.origin.y[i];
    const float wayZ = az + fx * alongXz + fy * leftZ - from * lanes.origin.z[i];
    // Basis about the ray's direction
    const float dx = lanes.direction.x[i], dy = lanes.direction.y[i], dz = lanes.direction.z[i];
    const float sign = std::copysign(1.0f, dz);
    const float q = -1.0f / (sign + dz);
    const float b = dx * dy * q;
    const float ux = 1.0f + sign * dx * dx * q, uy = sign * b, uz = -sign * dx;
    const float vx = b, vy = sign + dy * dy * q, vz = -dy;
    // Tangents of the angle between the ray and the place, and how they change along x and y
    const float along = dx * wayX + dy * wayY + dz * wayZ;
    const float offU = (ux * wayX + uy * wayY + uz * wayZ) / along;
    const float offV = (vx * wayX + vy * wayY + vz * wayZ) / along;
    const float growX = dx * alongXx + dy * alongXy + dz * alongXz;
    const float growY = dx * alongYx + dy * alongYy + dz * alongYz;
    const float slopeXu = (ux * alongXx + uy * alongXy + uz * alongXz - offU * growX) / along;
    const float slopeXv = (vx * alongXx + vy * alongXy + vz * alongXz - offV * growX) / along;
    const float slopeYu = (ux * alongYx + uy * alongYy + uz * alongYz - offU * growY) / along;
    const float slopeYv = (vx * alongYx + vy * alongYy + vz * alongYz - offV * growY) / along;
    const float determinant = slopeXu * slopeYv - slopeXv * slopeYu;
    const float sizeX = slopeXu * slopeXu + slopeXv * slopeXv;
    const float sizeY = slopeYu * slopeYu + slopeYv * slopeYv;
    const float size = sizeX < sizeY ? sizeY : sizeX;
    const float stepX = (slopeYu * offV - slopeYv * offU) / determinant;
    const float stepY = (slopeXv * offU - slopeXu * offV) / determinant;
    const float miss = std::sqrt(stepX * stepX + stepY * stepY);
    lanes.found[i] = inside & (cell >> 1U == lanes.reflector[i] ? 1 : 0) & (along > 0.0f ? 1 : 0) &
                     (std::abs(determinant) > 1e-6f * size ? 1 : 0) & (miss <= near ? 1 : 0);
    lanes.miss[i] = miss;
    const float nextX = px + stepX;
    const float nextY = py + stepY;
    // Where an offset is as good as 0 it is 0.
    const int stays = (std::abs(nextX - lanes.attachedX[i]) <= kSnap ? 1 : 0) &
                      (std::abs(nextY - lanes.attachedY[i]) <= kSnap ? 1 : 0);
    lanes.x[i] = stays != 0 ? lanes.attachedX[i] : nextX;
    lanes.y[i] = stays != 0 ? lanes.attachedY[i] : nextY;
  }
}

CATOPTRIC_INLINE void showBody(const KeyArrays& key, CellLanes& lanes) {
  const std::size_t count = wholeVectors(lanes.count);
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    // On a sample that sample alone counts.
    const float roundedX = std::floor(lanes.x[i] + 0.5f);
    const float roundedY = std::floor(lanes.y[i] + 0.5f);
    const int on = (std::abs(lanes.x[i] - roundedX) <= kSnap ? 1 : 0) &
                   (std::abs(lanes.y[i] - roundedY) <= kSnap ? 1 : 0);
    const float px = on != 0 ? roundedX : lanes.x[i];
    const float py = on != 0 ? roundedY : lanes.y[i];
    const int inside = (px >= 0.0f ? 1 : 0) & (py >= 0.0f ? 1 : 0) & (px < key.lastX ? 1 : 0) &
                       (py < key.lastY ? 1 : 0) & lanes.found[i];
    const int x = static_cast<int>(inside != 0 ? px : 0.0f);
    const int y = static_cast<int>(inside != 0 ? py : 0.0f);
    const float fx = px - static_cast<float>(x);
    const float fy = py - static_cast<float>(y);
    const int at = y * key.width + x;
    const std::uint32_t cell = key.cells[at];
    lanes.found[i] = inside & (cell >> 1U == lanes.reflector[i] ? 1 : 0);
    const float wa = (1.0f - fx) * (1.0f - fy);
    const float wb = fx * (1.0f - fy);
    const float wc = (1.0f - fx) * fy;
    const float wd = fx * fy;
    const float* const radiance = key.radiance;
    const int a = 3 * at;
    const int c = 3 * (at + key.width);
    lanes.light.x[i] =
        wa * radiance[a] + wb * radiance[a + 3] + wc * radiance[c] + wd * radiance[c + 3];
    lanes.light.y[i] =
        wa * radiance[a + 1] + wb * radiance[a + 4] + wc * radiance[c + 1] + wd * radiance[c + 4];
    lanes.light.z[i] =
        wa * radiance[a + 2] + wb * radiance[a + 5] + wc * radiance[c + 2] + wd * radiance[c + 5];
    const int nearest = at + (fx >= 0.5f ? 1 : 0) + (fy >= 0.5f ? key.width : 0);
    const float length = key.places[4 * nearest + 3];
    lanes.length[i] = (cell & 1U) != 0 ? std::numeric_limits<float>::infinity() : length;
  }
}

}  // namespace

void correct(const KeyFrame& key, float near, CellLanes& lanes) {
  if (key.width() < 2 || key.height() < 2) {  // no four samples
    std::fill_n(lanes.found.begin(), lanes.count, 0);
    return;
  }
  const KeyArrays arrays{key.width(),
                         static_cast<float>(key.width() - 1),
                         static_cast<float>(key.height() - 1),
                         key.cells().data(),
                         &key.places().front().x,
                         &key.radiances().front().x};
  atVectorLevel<moveBody>(arrays, near, lanes);
  atVectorLevel<showBody>(arrays, lanes);
}

}  // namespace catoptric::methods::reprojection
