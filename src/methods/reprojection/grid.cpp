#include "methods/reprojection/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
const Vec2 kInvalid(std::numeric_limits<float>::quiet_NaN());

float cross(const Vec2& a, const Vec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// Calls put(x, y, weights) for the sample centres (whole numbers) in a triangle.
template <class Put>
void rasterize(const std::array<Vec2, 3>& p, int width, int height, Put put) {
  if (p[0] == p[1] && p[1] == p[2]) {  // a point covers the nearest sample
    const Vec2 at = glm::floor(p[0] + 0.5f);
    if (at.x >= 0.0f && at.y >= 0.0f && at.x < static_cast<float>(width) &&
        at.y < static_cast<float>(height))
      put(static_cast<int>(at.x), static_cast<int>(at.y), Vec3(1.0f, 0.0f, 0.0f));
    return;
  }
  const float area = cross(p[1] - p[0], p[2] - p[0]);
  if (!(std::abs(area) > 1e-9f)) return;
  const Vec2 low = glm::max(glm::min(glm::min(p[0], p[1]), p[2]), Vec2(0.0f));
  const Vec2 high = glm::min(glm::max(glm::max(p[0], p[1]), p[2]),
                             Vec2(static_cast<float>(width - 1), static_cast<float>(height - 1)));
  for (int y = static_cast<int>(std::ceil(low.y)); static_cast<float>(y) <= high.y; ++y)
    for (int x = static_cast<int>(std::ceil(low.x)); static_cast<float>(x) <= high.x; ++x) {
      const Vec2 at(static_cast<float>(x), static_cast<float>(y));
      const Vec3 weights(cross(p[1] - at, p[2] - at) / area, cross(p[2] - at, p[0] - at) / area,
                         cross(p[0] - at, p[1] - at) / area);
      if (weights.x >= 0.0f && weights.y >= 0.0f && weights.z >= 0.0f) put(x, y, weights);
    }
}

/// Calls draw({a, b, c}) for the two triangles of each cell of the grid; draw({a, a, a}) for each
/// sample where they are `points`.
template <class Draw>
void forTriangles(const KeyFrame& key, bool points, Draw draw) {
  const std::size_t count = key.places().size();
  for (std::size_t a = 0; points && a < count; ++a) draw(std::array<std::size_t, 3>{a, a, a});
  if (points) return;
  for (int y = 0; y + 1 < key.height(); ++y)
    for (int x = 0; x + 1 < key.width(); ++x) {
      const std::size_t a = key.index(x, y);
      const std::size_t below = a + static_cast<std::size_t>(key.width());
      draw(std::array<std::size_t, 3>{a, a + 1, below});
      draw(std::array<std::size_t, 3>{a + 1, below + 1, below});
    }
}

bool similar(float a, float b, float epsilon) {
  return std::abs(a - b) <= epsilon * std::min(a, b);
}

Vec2 snapped(const Vec2& p) {
  const Vec2 rounded = glm::floor(p + 0.5f);
  const Vec2 beside = glm::abs(p - rounded);
  return std::max(beside.x, beside.y) <= kSnap ? rounded : p;
}

}  // namespace

void GridMapping::Layer::clear(std::size_t count) {
  reflector.assign(count, 0);
  depth.assign(count, kFar);
  radiance.resize(count);
}

void GridMapping::Layer::put(std::size_t at, std::uint32_t id, float z, const Vec3& light) {
  if (reflector[at] != 0 && !(z < depth[at])) return;
  reflector[at] = id;
  depth[at] = z;
  radiance[at] = light;
}

float GridMapping::miss(const KeyFrame& key, std::uint32_t reflector, const Vec4& place,
                        const Vec3& eye, int x, int y) const {
  if (!key.inside(x, y) || key.reflector(key.index(x, y)) != reflector) return kFar;
  const std::size_t at = key.index(x, y);
  const Vec3& surface = surface_[at];
  const Vec3& normal = key.normal(at);
  // What left the scene has a direction alone: there it is the directions that must agree.
  if (place.w == 0.0f) {
    const Vec3 off =
        glm::reflect(glm::normalize(surface - eye), normal) - glm::normalize(Vec3(place));
    return glm::dot(off, off);
  }
  const Vec3 mirrored = Vec3(place) - 2.0f * glm::dot(Vec3(place) - surface, normal) * normal;  // M
  const Vec3 way = surface - mirrored;
  const Vec3 off = glm::cross(eye - mirrored, way);
  return glm::dot(off, off) / std::max(glm::dot(way, way), 1e-30f);
}

Vec2 GridMapping::offsetOf(const KeyFrame& key, int x, int y, const Vec2& start,
                           const Vec3& eye) const {
  const std::uint32_t reflector = key.reflector(key.index(x, y));
  const Vec4 place = key.place(key.index(x, y));
  int atX = x + static_cast<int>(std::floor(start.x + 0.5f));
  int atY = y + static_cast<int>(std::floor(start.y + 0.5f));
  float best = miss(key, reflector, place, eye, atX, atY);
  for (int step = 0;; ++step) {
    std::array<std::array<float, 3>, 3> d{};
    int nextX = atX;
    int nextY = atY;
    float next = best;
    bool silhouette = false;
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const float m = miss(key, reflector, place, eye, atX + i, atY + j);
        d[j + 1][i + 1] = m;
        silhouette = silhouette || m == kFar;
        if (!(m < next)) continue;
        next = m;
        nextX = atX + i;
        nextY = atY + j;
      }
    // The print goes on while the best neighbour is as good, and so for ever on a plateau.
    if (nextX == atX && nextY == atY) {
      if (silhouette) return kInvalid;
      Vec2 offset(static_cast<float>(atX - x), static_cast<float>(atY - y));
      if (options_.refine) {
        // The squares of distances from a line are a parabola about the best one.
        const auto vertex = [](float before, float at, float after) {
          const float bend = before - 2.0f * at + after;
          return bend > 0.0f ? std::clamp(0.5f * (before - after) / bend, -0.5f, 0.5f) : 0.0f;
        };
        offset += Vec2(vertex(d[1][0], d[1][1], d[1][2]), vertex(d[0][1], d[1][1], d[2][1]));
      }
      const Vec2 size = glm::abs(offset);
      return std::max(size.x, size.y) <= kSnap ? Vec2(0.0f) : offset;
    }
    if (step >= kMostSearchSteps) return kInvalid;
    atX = nextX;
    atY = nextY;
    best = next;
  }
}

void GridMapping::search(const KeyFrame& key, const frame::Geometry& geometry,
                         const scene::Camera& now) {
  const std::size_t count =
      static_cast<std::size_t>(key.width()) * static_cast<std::size_t>(key.height());
  if (keyNumber_ != key.number() || offsets_.size() != count) {
    keyNumber_ = key.number();
    offsets_.assign(count, Vec2(0.0f));
    surface_.resize(count);
    for (int y = 0; y < key.height(); ++y)
      for (int x = 0; x < key.width(); ++x) {
        const std::size_t at = key.index(x, y);
        const Vec3 ray =
            scene::rayDirection(key.camera(), key.width(), key.height(),
                                static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        surface_[at] = key.camera().eye() + key.distance(at) * glm::normalize(ray);
      }
  }
  parallelFor(static_cast<std::size_t>(key.height()), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int x = 0; x < key.width(); ++x) {
        const int y = static_cast<int>(row);
        const std::size_t at = key.index(x, y);
        const std::uint32_t reflector = key.reflector(at);
        if (reflector == 0 || geometry.objects[reflector - 1].moving) {
          offsets_[at] = kInvalid;
          continue;
        }
        const Vec2 start = std::isnan(offsets_[at].x) ? Vec2(0.0f) : offsets_[at];
        offsets_[at] = offsetOf(key, x, y, start, now.eye());
      }
  });
}

void GridMapping::shift(const KeyFrame& key) {
  shifted_.clear(offsets_.size());
  const auto width = static_cast<std::size_t>(key.width());
  const bool splats = options_.mapping == Mapping::Splat;
  forTriangles(key, splats, [&](const std::array<std::size_t, 3>& at) {
    std::array<Vec2, 3> p;
    for (int i = 0; i < 3; ++i) {
      if (std::isnan(offsets_[at[i]].x) || key.surface(at[i]) != key.surface(at[0]) ||
          !similar(key.length(at[i]), key.length(at[(i + 1) % 3]), options_.epsilon))
        return;
      const std::size_t row = at[i] / width;
      p[i] = Vec2(static_cast<float>(at[i] % width), static_cast<float>(row)) + offsets_[at[i]];
    }
    // A triangle of the grid is half a sample large.
    if (std::abs(cross(p[1] - p[0], p[2] - p[0])) > options_.magnification) return;
    const bool sky = key.shown(at[0]) == 0;
    rasterize(p, key.width(), key.height(), [&](int x, int y, const Vec3& w) {
      shifted_.put(
          key.index(x, y), key.reflector(at[0]),
          sky ? kFar : w.x * key.length(at[0]) + w.y * key.length(at[1]) + w.z * key.length(at[2]),
          w.x * key.radiance(at[0]) + w.y * key.radiance(at[1]) + w.z * key.radiance(at[2]));
    });
  });
}

void GridMapping::warp(const KeyFrame& key, const scene::Camera& now) {
  warped_.clear(offsets_.size());
  const Mat4 sampleFromWorld = sampleFromWorldOf(now, key.width(), key.height());
  std::vector<Vec3> seen(offsets_.size());  // x, y, and metres from the eye; NaN: not
  for (std::size_t at = 0; at < seen.size(); ++at) {
    const Vec4 p = sampleFromWorld * Vec4(surface_[at], 1.0f);
    const bool valid = key.reflector(at) != 0 && shifted_.reflector[at] == key.reflector(at) &&
                       p.w > now.nearMetres;
    seen[at] = valid ? Vec3(snapped(Vec2(p.x, p.y) / p.w), glm::distance(surface_[at], now.eye()))
                     : Vec3(kInvalid, 0.0f);
  }
  const bool splats = options_.mapping == Mapping::Splat;
  forTriangles(key, splats, [&](const std::array<std::size_t, 3>& at) {
    for (int i = 0; i < 3; ++i)
      if (std::isnan(seen[at[i]].x) || key.reflector(at[i]) != key.reflector(at[0]) ||
          !similar(key.distance(at[i]), key.distance(at[(i + 1) % 3]), options_.epsilon))
        return;
    rasterize({Vec2(seen[at[0]]), Vec2(seen[at[1]]), Vec2(seen[at[2]])}, key.width(), key.height(),
              [&](int x, int y, const Vec3& w) {
                warped_.put(key.index(x, y), key.reflector(at[0]),
                            w.x * seen[at[0]].z + w.y * seen[at[1]].z + w.z * seen[at[2]].z,
                            w.x * shifted_.radiance[at[0]] + w.y * shifted_.radiance[at[1]] +
                                w.z * shifted_.radiance[at[2]]);
              });
  });
}

Outcome GridMapping::found(std::size_t at, std::uint32_t reflector, float distance,
                           Vec3& radiance) const {
  radiance = Vec3(0.0f);
  if (warped_.reflector[at] == 0) return Outcome::NotFound;
  if (warped_.reflector[at] != reflector || !similar(warped_.depth[at], distance, options_.epsilon))
    return Outcome::Discontinuity;
  radiance = warped_.radiance[at];
  return Outcome::Found;
}

}  // namespace catoptric::methods::reprojection
