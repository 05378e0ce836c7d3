#include "methods/perturbation/reflector.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "scene/implicit/gradient.h"

namespace catoptric::methods::perturbation {
namespace {

/// A reflector gets at least about so many paths, if need be by a smaller spacing (ours).
constexpr std::ptrdiff_t kFewestPaths = 64;
/// Places where a reflector shows itself are small: paths that meet it again are looked for at this
/// part of the spacing (ours).
constexpr float kSelfSpacing = 0.25f;
/// Frames are sampled beyond their border by this share of their size: triangles that reach into
/// the frame have vertices there (ours).
constexpr float kBorder = 0.5f;
/// Steps of retrace(), and the longest one as a share of the reflector's size (ours).
constexpr int kMaxSteps = 8;
constexpr double kLongestStep = 0.25;
/// Reflections of one point nearer to each other than this part of the way between their paths are
/// one (ours): what converges does so from both sides.
constexpr double kSameReflection = 0.25;
/// Without retrace(): the mirrored ray may miss the point by this angle's sine (ours).
constexpr double kWildPerturbation = 0.5;
/// Nearer than this part of its size a reflector does not show itself (ours).
constexpr double kOffSurface = 1e-3;

Vector<double> vectorOf(const glm::dvec3& p) {
  return {{p.x, p.y, p.z}};
}
glm::dvec3 pointOf(const Vector<double>& v) {
  return {v[0], v[1], v[2]};
}
glm::dvec3 gradientOf(const Jet3<double>& g) {
  return {g.gradient(0), g.gradient(1), g.gradient(2)};
}

/// The path from the eye by way of x, expanded; nullopt where it cannot be.
std::optional<Bounce<double>> bounceAt(const implicit::Surface& surface, const glm::dvec3& eye,
                                       glm::dvec3& x, glm::dvec3& direction) {
  Jet3<double> jet;
  if (implicit::derivativesAt(surface, x, jet) != implicit::PointStatus::Smooth)
    return std::nullopt;
  const glm::dvec3 gradient = gradientOf(jet);
  const double steepness2 = glm::dot(gradient, gradient);
  x -= jet.value() / steepness2 * gradient;
  const glm::dvec3 seen = x - eye;
  if (!(glm::length(seen) > 0.0)) return std::nullopt;
  direction = glm::reflect(glm::normalize(seen), gradient / std::sqrt(steepness2));
  return makeBounce(vectorOf(x + direction), vectorOf(x), jet,
                    straightTo(vectorOf(eye), vectorOf(x), 1.0), 1.0);
}

/// Pixels that show `bounds`, beyond the frame's border too: x0, y0, x1, y1.
std::array<float, 4> seenRectangle(const Box3& bounds, const View& view) {
  const auto width = static_cast<float>(view.width);
  const auto height = static_cast<float>(view.height);
  const Mat4 clip =
      scene::clipFromCamera(view.camera, width / height) * scene::cameraFromWorld(view.camera);
  std::array<float, 4> r{-kBorder * width, -kBorder * height, (1.0f + kBorder) * width,
                         (1.0f + kBorder) * height};
  std::array<float, 4> box{width * 2.0f, height * 2.0f, -width, -height};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1) != 0 ? bounds.max.x : bounds.min.x,
                 (corner & 2) != 0 ? bounds.max.y : bounds.min.y,
                 (corner & 4) != 0 ? bounds.max.z : bounds.min.z);
    const Vec4 c = clip * Vec4(p, 1.0f);
    if (!(c.w > view.camera.nearMetres)) return r;
    // Row 0 is the upper one
    const float x = (0.5f + 0.5f * c.x / c.w) * width;
    const float y = (0.5f - 0.5f * c.y / c.w) * height;
    box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
  }
  return {std::max(r[0], box[0]), std::max(r[1], box[1]), std::min(r[2], box[2]),
          std::min(r[3], box[3])};
}

}  // namespace

void PathCounts::add(const PathCounts& other) {
  paths += other.paths;
  linear += other.linear;
  quadratic += other.quadratic;
  retraced += other.retraced;
  notConverged += other.notConverged;
}

Reflector::Reflector(const implicit::Surface& surface, const Box3& bounds, const Box3& scene,
                     const View& view, const PathOptions& options)
    : surface_(surface),
      options_(options),
      eye_(view.camera.eye()),
      centre_(bounds.centre()),
      size_(bounds.diameter()),
      spread_(scene::pixelSpreadRad(view.camera, view.height)) {
  const std::array<float, 4> seen = seenRectangle(bounds, view);
  struct Path {
    Bounce<double> bounce;
    glm::dvec3 direction{0.0};
    double self = 0.0;  ///< metres to the reflector again; 0: never
  };
  struct Grid {
    int width = 0;
    int height = 0;
    std::vector<std::optional<Path>> paths;
  };
  const auto sample = [&](float spacing, bool again) {
    const auto cells = [&](float from, float to) {
      return to > from ? static_cast<int>(std::ceil((to - from) / spacing)) : 0;
    };
    Grid grid{cells(seen[0], seen[2]), cells(seen[1], seen[3]), {}};
    grid.paths.resize(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
    parallelFor(grid.paths.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t column = i % static_cast<std::size_t>(grid.width);
        const std::size_t row = i / static_cast<std::size_t>(grid.width);
        const glm::dvec3 d(
            scene::rayDirection(view.camera, view.width, view.height,
                                seen[0] + (static_cast<float>(column) + 0.5f) * spacing,
                                seen[1] + (static_cast<float>(row) + 0.5f) * spacing));
        const implicit::SurfaceHit hit = implicit::firstHit(surface_, {eye_, d});
        if (hit.status != implicit::HitStatus::Hit) continue;
        Path path;
        glm::dvec3 place = eye_ + hit.t * d;
        const auto bounce = bounceAt(surface_, eye_, place, path.direction);
        if (!bounce || statusOf(*bounce, 0.0) != PathStatus::Regular) continue;
        path.bounce = *bounce;
        if (again) {
          const implicit::SurfaceHit next =
              implicit::firstHit(surface_, {place, path.direction, kOffSurface * size_});
          if (next.status != implicit::HitStatus::Hit) continue;
          path.self = next.t;
        }
        grid.paths[i] = path;
      }
    });
    return grid;
  };
  const auto count = [](const Grid& grid) {
    return std::count_if(grid.paths.begin(), grid.paths.end(),
                         [](const auto& path) { return path.has_value(); });
  };
  // Both sets of rays: rays of self paths lie about the hit, not the start, which is on the
  // reflector too
  const auto makeOctree = [&](const Grid& grid, const Box3& box,
                              std::vector<std::uint32_t>& bounce) {
    std::vector<SampleRay> rays;
    std::vector<std::uint32_t> rayAt(grid.paths.size(), kNoRay);
    for (std::size_t i = 0; i < grid.paths.size(); ++i) {
      if (!grid.paths[i]) continue;
      const Path& path = *grid.paths[i];
      rayAt[i] = static_cast<std::uint32_t>(rays.size());
      bounce.push_back(static_cast<std::uint32_t>(bounces_.size()));
      bounces_.push_back(path.bounce);
      const double start = 0.5 * path.self;
      SampleRay ray{pointOf(path.bounce.x) + start * path.direction, path.direction};
      if (path.self > 0.0) ray.length = path.self;
      rays.push_back(ray);
    }
    std::vector<Neighbours> neighbours;
    if (!options.groups) neighbours = gridNeighbours(grid.width, grid.height, rayAt);
    return RayOctree(std::move(rays), glm::dvec3(box.min), glm::dvec3(box.max),
                     {.k = static_cast<std::size_t>(options.candidates)}, std::move(neighbours));
  };

  // One path every n-th pixel, more where the reflector is small in the frame
  auto spacing = static_cast<float>(options.sampleSpacing);
  Grid grid = sample(spacing, false);
  while (count(grid) < kFewestPaths && spacing >= 2.0f && !grid.paths.empty()) {
    spacing *= 0.5f;
    grid = sample(spacing, false);
  }
  if (count(grid) == 0) return;
  octree_ = makeOctree(grid, scene, rays_);
  const Grid self = sample(std::max(1.0f, kSelfSpacing * spacing), true);
  if (count(self) > 0) selfOctree_ = makeOctree(self, bounds, selfRays_);
}

double Reflector::pixels(const glm::dvec3& x, double metres) const {
  return metres / (spread_ * glm::distance(x, eye_));
}

bool Reflector::retrace(const glm::dvec3& point, glm::dvec3& x) const {
  for (int step = 0; step < kMaxSteps; ++step) {
    glm::dvec3 direction;
    const auto bounce = bounceAt(surface_, eye_, x, direction);
    if (!bounce) return false;
    const double rho = std::max(0.0, glm::dot(point - x, direction));
    if (statusOf(*bounce, rho) != PathStatus::Regular) return false;
    const Vector<double> move = vectorOf(point - (x + rho * direction));
    const glm::dvec3 first = pointOf(movedPoint<1>(*bounce, rho, move));
    const glm::dvec3 second = pointOf(movedPoint<2>(*bounce, rho, move));
    // Far off, the second order makes it worse
    const bool far = glm::distance(second, first) > 0.5 * glm::distance(first, x);
    glm::dvec3 way = (far ? first : second) - x;
    const double length = glm::length(way);
    if (!std::isfinite(length)) return false;
    const double longest = kLongestStep * size_;
    if (length > longest) way *= longest / length;
    x += way;
    if (!far && pixels(x, length) < static_cast<double>(options_.errorPixels)) return true;
  }
  return false;
}

bool Reflector::accept(const glm::dvec3& point, const glm::dvec3& x) const {
  const auto normal = implicit::normalAt(surface_, x);
  if (!normal) return false;
  const glm::dvec3 toEye = eye_ - x;
  const glm::dvec3 toPoint = point - x;
  if (glm::length(toPoint) < kOffSurface * size_) return false;
  const double towardsEye = glm::dot(*normal, toEye);
  if (!(towardsEye * glm::dot(*normal, toPoint) > 0.0)) return false;
  // What the eye sees of the inside it sees through an opening
  if (towardsEye < 0.0 && hiddenFrom(x) < 1.0 - kOffSurface) return false;
  const glm::dvec3 mirrored = glm::reflect(glm::normalize(-toEye), *normal);
  return glm::length(glm::cross(mirrored, glm::normalize(toPoint))) < kWildPerturbation;
}

void Reflector::add(const glm::dvec3& point, const glm::dvec3& x, const glm::dvec3& from,
                    std::vector<glm::dvec3>& starts, Reflections& result) const {
  for (std::uint32_t i = 0; i < result.count; ++i) {
    const double apart = glm::distance(result.at[i].x, x);
    if (apart <= kSameReflection * glm::distance(starts[i], from) ||
        pixels(x, apart) < 10.0 * static_cast<double>(options_.errorPixels))
      return;
  }
  if (result.count == kMaxReflections) return;
  starts.push_back(from);
  Reflection& reflection = result.at[result.count++];
  reflection.x = x;
  reflection.image = pointOf(virtualVertex<double>(vectorOf(point), {vectorOf(x)}, vectorOf(eye_)));
}

Reflections Reflector::reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                                     PathCounts& counts) const {
  Reflections result;
  const std::vector<std::uint32_t>& numbers = own ? selfRays_ : rays_;
  if (numbers.empty()) return result;
  std::vector<NearRay> nearest;
  const RayOctree& octree = own ? selfOctree_ : octree_;
  if (options_.groups) {
    octree.nearest(point, cursor, nearest);
  } else {
    octree.reflections(point, cursor, nearest);
  }
  const GroupLimits limits{static_cast<double>(options_.groupAngleRad),
                           static_cast<double>(options_.groupDistance) * size_};
  std::vector<std::uint32_t> tried;
  if (options_.groups) {
    tried = groupRepresentatives(octree.rays(), nearest, limits);
  } else {
    for (const NearRay& near : nearest) tried.push_back(near.ray);
  }
  std::vector<glm::dvec3> starts;
  for (const std::uint32_t ray : tried) {
    const Bounce<double>& bounce = bounces_[numbers[ray]];
    const SampleRay& sample = octree.rays()[ray];
    const glm::dvec3 start = pointOf(bounce.x);
    const double rho = std::max(0.0, glm::dot(point - start, sample.direction));
    glm::dvec3 x = start;
    bool found = true;
    if (options_.order != Order::Nearest) {
      found = statusOf(bounce, rho) == PathStatus::Regular;
      const Vector<double> step = vectorOf(point - (x + rho * sample.direction));
      const glm::dvec3 first = found ? pointOf(movedPoint<1>(bounce, rho, step)) : x;
      const glm::dvec3 second = found && options_.order != Order::Linear
                                    ? pointOf(movedPoint<2>(bounce, rho, step))
                                    : first;
      if (options_.order == Order::Auto) {
        // The remainder as the next term of a geometric series
        const double d1 = glm::distance(first, x);
        const double d2 = glm::distance(second, first);
        const double allowed = static_cast<double>(options_.errorPixels);
        if (found && pixels(x, d2) < allowed) {
          x = first;
          ++counts.linear;
        } else if (found && pixels(x, d2 * d2 / d1) < allowed) {
          x = second;
          ++counts.quadratic;
        } else {
          const double longest = kLongestStep * size_;
          if (found && d1 < longest && d2 < 0.5 * d1) x = second;
          found = retrace(point, x);
          ++counts.retraced;
        }
      } else {
        x = second;
      }
    }
    found = found && accept(point, x);
    if (found) {
      add(point, x, start, starts, result);
    } else {
      ++counts.notConverged;
    }
  }
  return result;
}

Reflections Reflector::reflectionsNear(const glm::dvec3& point,
                                       std::initializer_list<const Reflections*> known,
                                       PathCounts& counts) const {
  Reflections result;
  std::vector<glm::dvec3> starts;
  for (const Reflections* reflections : known) {
    for (std::uint32_t i = 0; i < reflections->count; ++i) {
      const glm::dvec3 start = reflections->at[i].x;
      glm::dvec3 x = start;
      ++counts.retraced;
      if (retrace(point, x) && accept(point, x)) {
        add(point, x, start, starts, result);
      } else {
        ++counts.notConverged;
      }
    }
  }
  return result;
}

double Reflector::hiddenFrom(const glm::dvec3& point) const {
  const implicit::SurfaceHit hit = implicit::firstHit(surface_, {eye_, point - eye_, 0.0, 1.0});
  return hit.status == implicit::HitStatus::Hit ? hit.t : 1.0;
}

}  // namespace catoptric::methods::perturbation
