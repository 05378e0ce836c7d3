#include "raster/regions/triangle_culling.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace catoptric::raster {
namespace {

/// Triangles worked on at once, in loops that compilers make vector code of. Ours.
constexpr std::size_t kBlock = 64;
/// Rounding of a sum of four products, in units of their magnitude: four times what one evaluation
/// may err, for the driver's and ours in any order. Ours.
constexpr float kRounding = 16.0f * std::numeric_limits<float>::epsilon();

/// Largest magnitude of the terms of dot(row, (p, 1)) within the bounds.
float magnitude(const Vec4& row, const Box3& bounds) {
  const Vec3 largest = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
  return glm::dot(glm::abs(Vec3(row)), largest) + std::abs(row.w);
}

// As the loops below need them: selections without branches
float least(float a, float b) {
  return a < b ? a : b;
}
float most(float a, float b) {
  return a > b ? a : b;
}

}  // namespace

TriangleCulling::TriangleCulling(const Mat4& clipFromWorld, const Box3& bounds, int width,
                                 int height, float snap, bool cullBacks, const Vec4& clip)
    : clip_(clip), cullBacks_(cullBacks) {
  const Mat4 rows = glm::transpose(clipFromWorld);
  rows_ = {rows[0], rows[1], rows[2], rows[3]};
  const float w = magnitude(rows[3], bounds);
  slackX_ = kRounding * (magnitude(rows[0], bounds) + w);
  slackY_ = kRounding * (magnitude(rows[1], bounds) + w);
  slackZ_ = kRounding * (magnitude(rows[2], bounds) + w);
  clipSlack_ = kRounding * magnitude(clip, bounds);
  halfWidth_ = 0.5f * static_cast<float>(width);
  halfHeight_ = 0.5f * static_cast<float>(height);
  leastW_ = std::max(slackX_ * halfWidth_, slackY_ * halfHeight_) / snap;
  // The driver's snap, what rounding may err where w > leastW_, and that of pixels themselves
  margin_ = 2.0f * snap + kRounding * static_cast<float>(std::max(width, height));
}

void TriangleCulling::append(std::span<const std::uint32_t> indices,
                             std::span<const Vec3> positions,
                             std::vector<std::uint32_t>& kept) const {
  std::array<std::array<float, kBlock>, 9> at;  // x, y, z of the three corners
  std::array<int, kBlock> shown;
  const Vec4 rx = rows_[0];
  const Vec4 ry = rows_[1];
  const Vec4 rz = rows_[2];
  const Vec4 rw = rows_[3];
  const Vec4 rc = clip_;
  const float slackX = slackX_;
  const float slackY = slackY_;
  const float slackZ = slackZ_;
  const float clipSlack = clipSlack_;
  const float leastW = leastW_;
  const float margin = margin_;
  const float halfWidth = halfWidth_;
  const float halfHeight = halfHeight_;
  const float backs = cullBacks_ ? 1.0f : 0.0f;
  for (std::size_t first = 0; first < indices.size(); first += 3 * kBlock) {
    const std::size_t count = std::min(kBlock, (indices.size() - first) / 3);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = positions[indices[first + 3 * i + k]];
        at[3 * k][i] = p.x;
        at[3 * k + 1][i] = p.y;
        at[3 * k + 2][i] = p.z;
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      const auto dot = [&](const Vec4& row, std::size_t corner) {
        return row.x * at[3 * corner][i] + row.y * at[3 * corner + 1][i] +
               row.z * at[3 * corner + 2][i] + row.w;
      };
      const float x0 = dot(rx, 0), x1 = dot(rx, 1), x2 = dot(rx, 2);
      const float y0 = dot(ry, 0), y1 = dot(ry, 1), y2 = dot(ry, 2);
      const float z0 = dot(rz, 0), z1 = dot(rz, 1), z2 = dot(rz, 2);
      const float w0 = dot(rw, 0), w1 = dot(rw, 1), w2 = dot(rw, 2);

      // On the outer side of one plane with all corners
      int seen = most(w0 - x0, most(w1 - x1, w2 - x2)) >= -slackX ? 1 : 0;
      seen &= most(w0 + x0, most(w1 + x1, w2 + x2)) >= -slackX ? 1 : 0;
      seen &= most(w0 - y0, most(w1 - y1, w2 - y2)) >= -slackY ? 1 : 0;
      seen &= most(w0 + y0, most(w1 + y1, w2 + y2)) >= -slackY ? 1 : 0;
      seen &= most(w0 - z0, most(w1 - z1, w2 - z2)) >= -slackZ ? 1 : 0;
      seen &= most(z0, most(z1, z2)) >= -slackZ ? 1 : 0;
      seen &= most(dot(rc, 0), most(dot(rc, 1), dot(rc, 2))) >= -clipSlack ? 1 : 0;

      // Pixels, and whether there is a centre (k + 0.5) between the least and the most
      const float u0 = (x0 / w0 + 1.0f) * halfWidth;
      const float u1 = (x1 / w1 + 1.0f) * halfWidth;
      const float u2 = (x2 / w2 + 1.0f) * halfWidth;
      const float v0 = (y0 / w0 + 1.0f) * halfHeight;
      const float v1 = (y1 / w1 + 1.0f) * halfHeight;
      const float v2 = (y2 / w2 + 1.0f) * halfHeight;
      const auto centre = [&](float low, float high, float half) {
        const float from = least(most(low - margin, -1.0f), 2.0f * half + 1.0f);
        const float to = least(most(high + margin, -1.0f), 2.0f * half + 1.0f);
        return static_cast<int>(from + 1.5f) != static_cast<int>(to + 1.5f) ? 1 : 0;
      };
      int covers = centre(least(u0, least(u1, u2)), most(u0, most(u1, u2)), halfWidth);
      covers &= centre(least(v0, least(v1, v2)), most(v0, most(v1, v2)), halfHeight);

      // Twice the area, and what moving the corners by the margin may change of it
      const float e1x = u1 - u0, e1y = v1 - v0, e2x = u2 - u0, e2y = v2 - v0;
      const float area = e1x * e2y - e1y * e2x;
      const float doubt =
          4.0f * margin *
          (std::abs(e1x) + std::abs(e1y) + std::abs(e2x) + std::abs(e2y) + 4.0f * margin);
      covers &= backs * area < -backs * doubt ? 0 : 1;

      shown[i] = seen & (covers | (least(w0, least(w1, w2)) > leastW ? 0 : 1));
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (shown[i] == 0) continue;
      const std::uint32_t* corners = &indices[first + 3 * i];
      kept.insert(kept.end(), corners, corners + 3);
    }
  }
}

}  // namespace catoptric::raster
