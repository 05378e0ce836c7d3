#include "methods/reprojection/key_frame.h"

#include <limits>

#include "core/parallel.h"

namespace catoptric::methods::reprojection {
namespace {

constexpr std::size_t kKeySamplesPerTask = 16384;

Vec3 placeOf(const trace::Hit& hit, const frame::Geometry& geometry) {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(hit.object)];
  const std::uint32_t* corner = &geometry.indices[range.firstIndex + 3 * hit.primitive];
  return (1.0f - hit.u - hit.v) * geometry.positions[corner[0]] +
         hit.u * geometry.positions[corner[1]] + hit.v * geometry.positions[corner[2]];
}

}  // namespace

Mat4 sampleFromWorldOf(const scene::Camera& camera, int width, int height) {
  // rayFromPixel maps (x, y, 1) to the ray one metre along the axis; its inverse maps a point
  // relative to the eye to (x z, y z, z).
  const Mat3 pixelFromRay = glm::inverse(scene::rayFromPixel(camera, width, height));
  Mat4 result(1.0f);
  const Vec3 eye = camera.eye();
  for (int column = 0; column < 3; ++column) {
    const Vec3 c = pixelFromRay[column];
    result[column] = Vec4(c.x - 0.5f * c.z, c.y - 0.5f * c.z, 0.0f, c.z);
  }
  const Vec3 origin = -(pixelFromRay * eye);
  result[3] = Vec4(origin.x - 0.5f * origin.z, origin.y - 0.5f * origin.z, 1.0f, origin.z);
  return result;
}

void KeyFrame::begin(int width, int height, const scene::Camera& camera,
                     const frame::Lighting& lighting, const frame::Geometry& geometry,
                     bool normals) {
  ++number_;
  width_ = width;
  height_ = height;
  camera_ = camera;
  lighting_ = lighting;
  sampleFromWorld_ = sampleFromWorldOf(camera, width_, height_);
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  surface_.assign(count, 0);
  place_.resize(count);
  radiance_.resize(count);
  distance_.resize(count);
  normal_.resize(normals ? count : 0);
  moving_.clear();
  worldFromObject_.clear();
  hitObjectMoves_.clear();
  bool moves = false;
  for (const frame::ObjectRange& range : geometry.objects) {
    worldFromObject_.push_back(range.worldFromObject);
    hitObjectMoves_.push_back(range.moving ? 1 : 0);
    moves = moves || range.moving;
  }
  hits_.assign(moves ? count : 0, {});
}

void KeyFrame::keep(std::size_t at, const trace::ReflectionPoint& point, const trace::FirstHit& hit,
                    const Vec3& radiance) {
  std::uint32_t shown = 0;
  radiance_[at] = radiance;
  distance_[at] = point.distance;
  if (!normal_.empty()) normal_[at] = point.normal;
  if (hit.hit.miss()) {
    place_[at] = Vec4(hit.direction, point.distance);
  } else {
    shown = static_cast<std::uint32_t>(hit.hit.object + 1);
    place_[at] = Vec4(hit.origin + hit.hit.distance * hit.direction,
                      point.distance + hit.hit.distance * glm::length(hit.direction));
    if (!hits_.empty()) hits_[at] = hit.hit;
  }
  surface_[at] = (static_cast<std::uint64_t>(point.object) << 32U) | shown;
}

void KeyFrame::finish(const frame::Geometry& geometry, float epsilon) {
  for (std::size_t at = 0; at < hits_.size(); ++at) {
    if (reflector(at) == 0 || shown(at) == 0 || hitObjectMoves_[shown(at) - 1] == 0) continue;
    // A hit on an implicit surface is not a point of its triangles
    if (geometry.objects[shown(at) - 1].surface >= 0)
      surface_[at] = 0;
    else
      moving_.push_back({at, hits_[at]});
  }
  hits_ = {};
  findCells(epsilon);
  findNearEdges(epsilon);
}

void KeyFrame::findCells(float epsilon) {
  const auto width = static_cast<std::size_t>(width_);
  cells_.assign(surface_.size(), 0);
  // The search in cells reads places that nothing is kept of, before it knows: never older frames'.
  parallelFor(surface_.size(), kKeySamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at)
      if (surface_[at] == 0) place_[at] = Vec4(0.0f);
  });
  parallelFor(static_cast<std::size_t>(height_ - 1), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
      for (std::size_t a = y * width; a + 1 < (y + 1) * width; ++a) {
        if (surface_[a] == 0 || !continuous(a, a + 1, epsilon) ||
            !continuous(a, a + width, epsilon) || !continuous(a + width + 1, a + 1, epsilon) ||
            !continuous(a + width + 1, a + width, epsilon))
          continue;
        cells_[a] = reflector(a) << 1U | (shown(a) == 0 ? 1U : 0U);
      }
  });
}

void KeyFrame::findNearEdges(float epsilon) {
  const auto width = static_cast<std::size_t>(width_);
  const auto nearer = [&](std::size_t at, std::size_t beside) {
    if (reflector(at) != reflector(beside)) return false;
    const bool one = shown(at) == shown(beside);
    return shown(beside) == 0 || length(at) < length(beside) * (one ? 1.0f - epsilon : 1.0f);
  };
  nearEdges_.clear();
  for (std::size_t at = 0; at < surface_.size(); ++at) {
    // One surface about it
    if (shown(at) == 0 ||
        (at > width && cells_[at] != 0 && cells_[at - 1] != 0 && cells_[at - width] != 0))
      continue;
    const std::size_t x = at % width;
    if ((x > 0 && nearer(at, at - 1)) || (x + 1 < width && nearer(at, at + 1)) ||
        (at >= width && nearer(at, at - width)) ||
        (at + width < surface_.size() && nearer(at, at + width)))
      nearEdges_.push_back(static_cast<std::uint32_t>(at));
  }
}

void KeyFrame::follow(const frame::Geometry& geometry) {
  parallelFor(moving_.size(), kKeySamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      place_[moving_[i].at] = Vec4(placeOf(moving_[i].hit, geometry), place_[moving_[i].at].w);
  });
}

Vec3 KeyFrame::formerly(const Vec3& position, int object, const frame::Geometry& geometry) const {
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  if (!range.moving) return position;
  return Vec3(worldFromObject_[static_cast<std::size_t>(object)] *
              (glm::inverse(range.worldFromObject) * Vec4(position, 1.0f)));
}

Vec3 KeyFrame::reflectorNow(std::size_t at, const frame::Geometry& geometry) const {
  const std::size_t row = at / static_cast<std::size_t>(width_);
  const auto x = static_cast<float>(at % static_cast<std::size_t>(width_));
  const auto y = static_cast<float>(row);
  const Vec3 position =
      camera_.eye() +
      distance_[at] * scene::rayDirection(camera_, width_, height_, x + 0.5f, y + 0.5f);
  const std::size_t object = reflector(at) - 1;
  const frame::ObjectRange& range = geometry.objects[object];
  if (!range.moving) return position;
  return Vec3(range.worldFromObject *
              (glm::inverse(worldFromObject_[object]) * Vec4(position, 1.0f)));
}

std::optional<Vec2> KeyFrame::project(const Vec3& position, int object,
                                      const frame::Geometry& geometry) const {
  const Vec4 p = sampleFromWorld_ * Vec4(formerly(position, object, geometry), 1.0f);
  if (!(p.w > 0.0f)) return std::nullopt;
  return Vec2(p.x / p.w, p.y / p.w);
}

}  // namespace catoptric::methods::reprojection
