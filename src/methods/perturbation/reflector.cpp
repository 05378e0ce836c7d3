#include "methods/perturbation/reflector.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "scene/implicit/gradient.h"

namespace catoptric::methods::perturbation {
namespace {

/// Places where a reflector shows itself are small: paths that meet it again are looked for at this
/// part of the spacing (ours).
constexpr float kSelfSpacing = 0.25f;
/// At the rim of a lens a scene shows on few pixels: this part of the spacing (ours; on a lens of
/// 80 pixels it brings L1_8bit from 3.5 to 1.2).
constexpr float kRefractedSpacing = 0.25f;
/// Frames are sampled beyond their border by this share of their size: triangles that reach into
/// the frame have vertices there (ours).
constexpr float kBorder = 0.5f;
/// Images of a reflector that fall between the samples are looked for at so many of its points,
/// and sampled so many times across, but no denser than every n-th pixel (ours).
constexpr std::size_t kImagePoints = 64;
constexpr float kImageSamples = 12.0f;
constexpr float kImageSpacing = 0.125f;
/// Between neighbouring paths whose directions differ by more than this, rad, and by another angle
/// than the first one's bounce tells, by this share of it, there are two more (ours; lower shares
/// bring more paths and nothing else).
constexpr double kLeastTurn = 0.2;
constexpr double kTurnError = 0.4;
constexpr int kThirds = 3;
/// Steps of retrace(), and the longest one as a share of the reflector's size (ours).
constexpr int kMaxSteps = 8;
constexpr double kLongestStep = 0.25;
/// A step that leads beyond what the first reflector shows of the others is halved so many times
/// (ours).
constexpr int kMaxShortenings = 2;
/// Quadratic moves of exact paths are taken instead of another step, or of a path that was traced
/// for another point, where the estimate is below this part of the error allowed (ours).
constexpr double kSmallRemainder = 0.1;
/// ... and where that point shows nearer than this, pixels (ours).
constexpr double kTracedReach = 12.0;
/// Reflections of one point nearer to each other than this part of the way between their paths are
/// one (ours): what converges does so from both sides.
constexpr double kSameReflection = 0.25;
/// Without retrace(): the mirrored ray may miss the point by this angle's sine (ours).
constexpr double kWildPerturbation = 0.05;
/// The normal where a path was moved to is known well enough from where it was (ours) when it turns
/// by less than this there, rad, and both segments leave the surface by more, cosines.
constexpr double kSmallTurn = 0.3;
constexpr double kSteep = 0.1;
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

/// Where light along `direction`, of unit length, goes at a turn; zero where a surface that should
/// let it out reflects it totally.
glm::dvec3 onwards(const Turn& turn, const glm::dvec3& direction, const glm::dvec3& normal) {
  if (!turn.through) return glm::reflect(direction, normal);
  const glm::dvec3 against = glm::dot(normal, direction) > 0.0 ? -normal : normal;
  return glm::refract(direction, against, turn.indexBefore / turn.indexAfter);
}

/// Whether a surface has no edges, as far as its formula's operations tell.
bool isSmooth(const implicit::Surface& surface) {
  using implicit::Code;
  return std::none_of(surface.tape.begin(), surface.tape.end(),
                      [](const implicit::Operation& operation) {
                        const Code code = operation.code;
                        return code == Code::Min || code == Code::Max || code == Code::Abs ||
                               code == Code::AbsPower;
                      });
}

/// As remainderOf() of order 2: of the first place, by the lengths of its linear and second motion.
double remainder(double linear, double second, double rho, const glm::dvec3& step) {
  constexpr double kTiny = 0x1p-500;
  return second * (glm::length(step) / (rho + kTiny) + 2.0 * second / (linear + kTiny));
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

/// The rectangle of the cells of `spacing` pixels that hold something, and those about it.
std::array<float, 4> filledPart(std::span<const std::uint32_t> cells, int width,
                                const std::array<float, 4>& seen, float spacing) {
  std::array<float, 4> box{seen[2], seen[3], seen[0], seen[1]};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] == kNoRay) continue;
    const std::size_t column = i % static_cast<std::size_t>(width);
    const std::size_t row = i / static_cast<std::size_t>(width);
    const float x = seen[0] + static_cast<float>(column) * spacing;
    const float y = seen[1] + static_cast<float>(row) * spacing;
    box = {std::min(box[0], x - spacing), std::min(box[1], y - spacing),
           std::max(box[2], x + 2.0f * spacing), std::max(box[3], y + 2.0f * spacing)};
  }
  return box;
}

}  // namespace

void PathCounts::add(const PathCounts& other) {
  paths += other.paths;
  linear += other.linear;
  quadratic += other.quadratic;
  retraced += other.retraced;
  notConverged += other.notConverged;
  leftOut += other.leftOut;
}

Reflector::Reflector(std::span<const Turn> turns, const Reflector* before, const Box3& scene,
                     const View& view, const PathOptions& options)
    : turns_(turns.begin(), turns.end()),
      before_(before),
      options_(options),
      eye_(view.camera.eye()),
      centre_(turns.back().bounds.centre()),
      size_(turns.back().bounds.diameter()),
      spread_(scene::pixelSpreadRad(view.camera, view.height)) {
  assert(turns_.size() <= kMaxTurns && (turns_.size() == 1) == (before == nullptr));
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    sizes_[i] = turns_[i].bounds.diameter();
    smooth_[i] = isSmooth(*turns_[i].surface);
  }
  struct Sample {
    Path path;
    double self = 0.0;  ///< metres to the last reflector again; 0: never
  };
  /// Samples in the middle of cells of the image, of one or several squares of the grid each.
  struct Grid {
    int width = 0;
    int height = 0;
    std::vector<std::uint32_t> sampleAt;  ///< by square; kNoRay: none
    std::vector<Sample> samples;
    std::uint64_t total = 0;  ///< rays that the last surface reflects totally
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(samples.size()); }
  };
  // Adds samples in the middle of those squares of a grid that are asked for
  const auto addSamples = [&](Grid& grid, const std::array<float, 4>& seen, float spacing,
                              bool again, std::span<const std::size_t> squares) {
    std::vector<std::unique_ptr<Sample>> samples(squares.size());
    std::atomic<std::uint64_t> total{0};
    parallelFor(squares.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t column = squares[i] % static_cast<std::size_t>(grid.width);
        const std::size_t row = squares[i] / static_cast<std::size_t>(grid.width);
        const glm::dvec3 d(
            scene::rayDirection(view.camera, view.width, view.height,
                                seen[0] + (static_cast<float>(column) + 0.5f) * spacing,
                                seen[1] + (static_cast<float>(row) + 0.5f) * spacing));
        const implicit::SurfaceHit hit = implicit::firstHit(*turns_[0].surface, {eye_, d});
        if (hit.status != implicit::HitStatus::Hit) continue;
        Sample found;
        const Found path = pathBy(eye_ + hit.t * d, found.path);
        if (path == Found::TotalReflection) ++total;
        if (path != Found::Path || !movable(found.path.bounces.data(), 0.0)) continue;
        if (turns_.back().total() && wouldLeave(found.path)) continue;
        if (again) {
          const implicit::SurfaceHit next = implicit::firstHit(
              *turns_.back().surface,
              {found.path.place(lastTurn()), found.path.direction, kOffSurface * size_});
          if (next.status != implicit::HitStatus::Hit) continue;
          found.self = next.t;
        }
        samples[i] = std::make_unique<Sample>(found);
      }
    });
    grid.total += total;
    for (std::size_t i = 0; i < squares.size(); ++i) {
      grid.sampleAt[squares[i]] = kNoRay;
      if (!samples[i]) continue;
      grid.sampleAt[squares[i]] = static_cast<std::uint32_t>(grid.samples.size());
      grid.samples.push_back(*samples[i]);
    }
  };
  const auto sample = [&](const std::array<float, 4>& seen, float spacing, bool again) {
    const auto cells = [&](float from, float to) {
      return to > from ? static_cast<int>(std::ceil((to - from) / spacing)) : 0;
    };
    Grid grid;
    grid.width = cells(seen[0], seen[2]);
    grid.height = cells(seen[1], seen[3]);
    grid.sampleAt.resize(static_cast<std::size_t>(grid.width) *
                         static_cast<std::size_t>(grid.height));
    std::vector<std::size_t> all(grid.sampleAt.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    addSamples(grid, seen, spacing, again, all);
    return grid;
  };
  // A grid of thirds, with more samples where neighbouring paths tell too little of each other
  const auto refined = [&](const Grid& coarse, const std::array<float, 4>& seen, float spacing) {
    Grid grid;
    grid.width = kThirds * coarse.width;
    grid.height = kThirds * coarse.height;
    grid.sampleAt.resize(static_cast<std::size_t>(grid.width) *
                         static_cast<std::size_t>(grid.height));
    grid.samples = coarse.samples;
    grid.total = coarse.total;
    const auto at = [&](int x, int y) {
      return x < 0 || y < 0 || x >= coarse.width || y >= coarse.height
                 ? kNoRay
                 : coarse.sampleAt[static_cast<std::size_t>(y * coarse.width + x)];
    };
    std::vector<std::size_t> between;
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        const std::uint32_t own = at(x, y);
        bool differs = false;
        for (int i = 0; own != kNoRay && i < 9; ++i) {
          const std::uint32_t other = at(x + i % 3 - 1, y + i / 3 - 1);
          differs = differs || (other != kNoRay && other != own &&
                                unlike(coarse.samples[own].path, coarse.samples[other].path));
        }
        for (int i = 0; i < kThirds * kThirds; ++i) {
          const auto square = static_cast<std::size_t>((kThirds * y + i / kThirds) * grid.width +
                                                       kThirds * x + i % kThirds);
          grid.sampleAt[square] = own;
          if (differs && i != kThirds * kThirds / 2) between.push_back(square);
        }
      }
    }
    addSamples(grid, seen, spacing / kThirds, false, between);
    return grid;
  };
  // Both sets of rays: rays of self paths lie about the hit, not the start, which is on the
  // reflector too
  const auto makeOctree = [&](const Grid& grid, const Box3& box,
                              std::vector<std::uint32_t>& paths) {
    std::vector<SampleRay> rays;
    for (const Sample& found : grid.samples) {
      const Path& path = found.path;
      paths.push_back(static_cast<std::uint32_t>(pathCount_++));
      const auto count = static_cast<std::ptrdiff_t>(turns_.size());
      bounces_.insert(bounces_.end(), path.bounces.begin(), path.bounces.begin() + count);
      distances_.insert(distances_.end(), path.distances.begin(), path.distances.begin() + count);
      SampleRay ray{path.place(lastTurn()) + 0.5 * found.self * path.direction, path.direction};
      if (found.self > 0.0) ray.length = found.self;
      rays.push_back(ray);
    }
    std::vector<Neighbours> neighbours;
    if (!options.groups) neighbours = gridNeighbours(grid.width, grid.height, grid.sampleAt);
    return RayOctree(std::move(rays), glm::dvec3(box.min), glm::dvec3(box.max),
                     {.k = static_cast<std::size_t>(options.candidates)}, std::move(neighbours));
  };

  // One path every n-th pixel, more where the reflector is small in the frame
  std::array<float, 4> seen = seenRectangle(turns_[0].bounds, view);
  auto spacing = static_cast<float>(options.sampleSpacing);
  if (refracts()) spacing = std::max(1.0f, kRefractedSpacing * spacing);
  Grid grid = sample(seen, spacing, false);
  while (grid.count() < options.fewestPaths && spacing >= 2.0f && !grid.sampleAt.empty()) {
    if (turns_.size() > 1) {
      // The later reflectors fill a part of the first: look there, and give up soon
      if (grid.count() == 0 && spacing <= 0.5f * static_cast<float>(options.sampleSpacing)) break;
      if (grid.count() > 0) seen = filledPart(grid.sampleAt, grid.width, seen, spacing);
    }
    spacing *= 0.5f;
    grid = sample(seen, spacing, false);
  }
  if (grid.count() == 0) {
    if (const auto image = imageOfLast(view)) {
      seen = *image;
      const float across = std::max(seen[2] - seen[0], seen[3] - seen[1]);
      spacing = std::clamp(across / kImageSamples, kImageSpacing, spacing);
      grid = sample(seen, spacing, false);
      missed_ = grid.count() == 0;
    }
  }
  totalReflections_ = grid.total;
  if (grid.count() == 0) return;
  if (options.order == Order::Auto && spacing >= kThirds && !refracts())
    grid = refined(grid, seen, spacing);
  octree_ = makeOctree(grid, scene, rays_);
  const Grid self = sample(seen, std::max(1.0f, kSelfSpacing * spacing), true);
  if (self.count() > 0) selfOctree_ = makeOctree(self, turns_.back().bounds, selfRays_);
}

std::optional<std::array<float, 4>> Reflector::imageOfLast(const View& view) const {
  const std::span<const Vec3> points = turns_.back().points;
  if (!before_ || before_->pathCount() == 0) return std::nullopt;
  const bool own = turns_[lastTurn()].surface == turns_[lastTurn() - 1].surface;
  const std::array<float, 4> all = seenRectangle(turns_[0].bounds, view);
  const glm::dmat4 clip =
      glm::dmat4(scene::clipFromCamera(
          view.camera, static_cast<float>(view.width) / static_cast<float>(view.height))) *
      glm::dmat4(scene::cameraFromWorld(view.camera));
  std::array<float, 4> image{all[2], all[3], all[0], all[1]};
  RayOctree::Cursor cursor;
  PathCounts counts;
  for (std::size_t i = 0; i < std::min(points.size(), kImagePoints); ++i) {
    const glm::dvec3 point(points[i * points.size() / std::min(points.size(), kImagePoints)]);
    const Reflections found = before_->reflectionsOf(point, own, cursor, counts);
    // Exactly, whatever the order
    Reflections exact;
    before_->addReflectionsNear(point, found, exact, counts);
    for (std::uint32_t k = 0; k < exact.count; ++k) {
      const glm::dvec4 c = clip * glm::dvec4(exact.at[k].x, 1.0);
      if (!(c.w > 0.0)) continue;
      const auto x = static_cast<float>((0.5 + 0.5 * c.x / c.w) * view.width);
      const auto y = static_cast<float>((0.5 - 0.5 * c.y / c.w) * view.height);
      image = {std::min(image[0], x), std::min(image[1], y), std::max(image[2], x),
               std::max(image[3], y)};
    }
  }
  // A little more than between the points that were found
  const float margin = kImageSpacing + 0.25f * std::max(image[2] - image[0], image[3] - image[1]);
  image = {std::max(all[0], image[0] - margin), std::max(all[1], image[1] - margin),
           std::min(all[2], image[2] + margin), std::min(all[3], image[3] + margin)};
  if (!(image[0] < image[2] && image[1] < image[3])) return std::nullopt;
  return image;
}

bool Reflector::unlike(const Path& a, const Path& b) const {
  const Bounce<double>& bounce = a.bounces[lastTurn()];
  const Vector<double> step = vectorOf(b.place(lastTurn()) - a.place(lastTurn()));
  const std::array<double, 2> y{dot(bounce.e1, step), dot(bounce.e2, step)};
  const double expected = std::sqrt(std::max(0.0, form(bounce.omega, y, y)));
  const double turned = glm::length(b.direction - a.direction);
  const double larger = std::max(turned, expected);
  return larger > kLeastTurn && std::abs(turned - expected) > kTurnError * larger;
}

Reflector::Found Reflector::pathBy(glm::dvec3 x, Path& path) const {
  std::array<Jet3<double>, kMaxTurns> jets;
  Places places;
  glm::dvec3 direction = x - eye_;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    if (i > 0) {
      // Away from a surface that it has just left
      const double start = turns_[i].surface == turns_[i - 1].surface ? kOffSurface * sizes_[i] : 0;
      const implicit::SurfaceHit hit =
          implicit::firstHit(*turns_[i].surface, {places[i - 1], direction, start});
      if (hit.status != implicit::HitStatus::Hit) return Found::Nothing;
      x = places[i - 1] + hit.t * direction;
    }
    if (implicit::derivativesAt(*turns_[i].surface, x, jets[i]) != implicit::PointStatus::Smooth)
      return Found::Nothing;
    const glm::dvec3 gradient = gradientOf(jets[i]);
    const double steepness2 = glm::dot(gradient, gradient);
    x -= jets[i].value() / steepness2 * gradient;
    places[i] = x;
    const glm::dvec3 arrives = x - (i > 0 ? places[i - 1] : eye_);
    if (!(glm::length(arrives) > 0.0)) return Found::Nothing;
    direction = onwards(turns_[i], glm::normalize(arrives), gradient / std::sqrt(steepness2));
    if (direction == glm::dvec3(0.0)) return Found::TotalReflection;
  }
  path.direction = direction;
  Eikonal<double> rest = straightTo(vectorOf(eye_), vectorOf(places[0]), 1.0);
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const bool end = i == lastTurn();
    const glm::dvec3 next = end ? places[i] + direction : places[i + 1];
    path.bounces[i] =
        makeBounce(vectorOf(next), vectorOf(places[i]), jets[i], rest, turns_[i].indexAfter);
    if (end) break;
    path.distances[i] = glm::distance(next, places[i]);
    if (!(path.distances[i] > 0.0) ||
        statusOf(path.bounces[i], path.distances[i]) != PathStatus::Regular)
      return Found::Nothing;
    rest = perturbation::before(path.bounces[i], path.distances[i]);
  }
  return Found::Path;
}

bool Reflector::wouldLeave(const Path& path) const {
  const auto normal = implicit::normalAt(*turns_.back().surface, path.place(lastTurn()));
  const glm::dvec3 arrives =
      path.place(lastTurn()) - (lastTurn() > 0 ? path.place(lastTurn() - 1) : eye_);
  Turn out = turns_.back();
  out.through = true;
  out.indexAfter = 1.0;
  return normal && onwards(out, glm::normalize(arrives), *normal) != glm::dvec3(0.0);
}

bool Reflector::movable(const Bounce<double>* bounces, double rho) const {
  // The bounces before the last were when the path was expanded
  return statusOf(bounces[lastTurn()], rho) == PathStatus::Regular;
}

void Reflector::move(const Bounce<double>* bounces, const double* distances, double rho,
                     const glm::dvec3& step, Places& first, Places& second) const {
  // [Chen2000] (15), (16)
  const std::size_t last = lastTurn();
  const Move<double> moved = moveOf(bounces[last], rho, vectorOf(step));
  Vector<double> linear = moved.linear;
  Vector<double> quadratic = moved.linear + moved.second;
  first[last] = pointOf(bounces[last].x + linear);
  second[last] = pointOf(bounces[last].x + quadratic);
  for (std::size_t i = last; i-- > 0;) {
    linear = moveOf(bounces[i], distances[i], linear).linear;
    const Move<double> next = moveOf(bounces[i], distances[i], quadratic);
    quadratic = next.linear + next.second;
    first[i] = pointOf(bounces[i].x + linear);
    second[i] = pointOf(bounces[i].x + quadratic);
  }
}

double Reflector::pixels(const glm::dvec3& x, double metres) const {
  return metres / (spread_ * glm::distance(x, eye_));
}

bool Reflector::retrace(const glm::dvec3& point, Places& places, Traced* traced) const {
  const std::size_t last = lastTurn();
  glm::dvec3 x = places[0];
  Path path;
  Places first;
  Places second;
  // pathBy() makes one step to the surface; guesses may need two
  if (const auto gradient = implicit::gradientAt(*turns_[0].surface, x))
    x -= implicit::valueAt(*turns_[0].surface, x) / glm::dot(*gradient, *gradient) * *gradient;
  glm::dvec3 from = x;
  int shortenings = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    if (pathBy(x, path) != Found::Path) {
      // A step beyond what the first reflector shows of the others
      if (last == 0 || step == 0 || shortenings++ == kMaxShortenings) return false;
      x = 0.5 * (x + from);
      continue;
    }
    from = x = path.place(0);
    shortenings = 0;
    const glm::dvec3 leaves = path.place(last);
    const double rho = std::max(0.0, glm::dot(point - leaves, path.direction));
    if (!movable(path.bounces.data(), rho)) return false;
    const glm::dvec3 away = point - (leaves + rho * path.direction);
    move(path.bounces.data(), path.distances.data(), rho, away, first, second);
    // Far off, the second order makes it worse
    const double d1 = glm::distance(first[0], x);
    const double d2 = glm::distance(second[0], first[0]);
    const bool far = d2 > 0.5 * d1;
    places = far ? first : second;
    glm::dvec3 way = places[0] - x;
    const double length = glm::length(way);
    if (!std::isfinite(length)) return false;
    const double longest = kLongestStep * sizes_[0];
    if (length > longest) way *= longest / length;
    x += way;
    const auto allowed = static_cast<double>(options_.errorPixels);
    if (far || !(pixels(x, length) < allowed ||
                 (length <= longest && !refracts() &&
                  pixels(x, remainder(d1, d2, rho, away)) < kSmallRemainder * allowed)))
      continue;
    if (traced) {
      if (traced->paths_.size() < Traced::kCount) {
        traced->paths_.push_back(path);
      } else {
        traced->paths_[traced->next_] = path;
        traced->next_ = (traced->next_ + 1) % Traced::kCount;
      }
    }
    return accept(point, places, path.bounces.data());
  }
  return false;
}

const Reflector::Path* Reflector::moveTraced(const glm::dvec3& point, const Traced& traced,
                                             Places& places) const {
  // The nearest one
  const Path* path = nullptr;
  double least = kTracedReach;
  for (const Path& other : traced.paths_) {
    const double apart = pixels(places[0], glm::distance(other.place(0), places[0]));
    if (!(apart < least)) continue;
    least = apart;
    path = &other;
  }
  if (!path) return nullptr;
  const glm::dvec3 leaves = path->place(lastTurn());
  const double rho = std::max(0.0, glm::dot(point - leaves, path->direction));
  if (!movable(path->bounces.data(), rho)) return nullptr;
  const glm::dvec3 step = point - (leaves + rho * path->direction);
  Places first;
  Places second;
  move(path->bounces.data(), path->distances.data(), rho, step, first, second);
  const double d1 = glm::distance(first[0], path->place(0));
  const double d2 = glm::distance(second[0], first[0]);
  const double allowed = kSmallRemainder * static_cast<double>(options_.errorPixels);
  const bool near = pixels(places[0], glm::distance(second[0], places[0])) < kTracedReach;
  if (!near || d2 > 0.5 * d1 || !(pixels(path->place(0), remainder(d1, d2, rho, step)) < allowed))
    return nullptr;
  places = second;
  return path;
}

bool Reflector::surelyTurns(std::size_t turn, const Bounce<double>& bounce, const glm::dvec3& x,
                            const glm::dvec3& back, const glm::dvec3& ahead) const {
  const Vector<double> way = vectorOf(x) - bounce.x;
  const std::array<double, 2> y{dot(bounce.e1, way), dot(bounce.e2, way)};
  const std::array<double, 2> turned = times(bounce.b, y);
  if (turned[0] * turned[0] + turned[1] * turned[1] > kSmallTurn * kSmallTurn) return false;
  const glm::dvec3 normal =
      glm::normalize(pointOf(bounce.n + turned[0] * bounce.e1 + turned[1] * bounce.e2));
  const glm::dvec3 arrives = -glm::normalize(back);
  const glm::dvec3 leaves = glm::normalize(ahead);
  const double before = -glm::dot(normal, arrives);
  const double after = glm::dot(normal, leaves) * (turns_[turn].through ? -1.0 : 1.0);
  if (!(std::min(std::abs(before), std::abs(after)) > kSteep && before * after > 0.0 &&
        (before > 0.0 || turns_[turn].inside)))
    return false;
  const glm::dvec3 onward = onwards(turns_[turn], arrives, normal);
  return onward != glm::dvec3(0.0) && glm::length(glm::cross(onward, leaves)) < kWildPerturbation;
}

bool Reflector::accept(const glm::dvec3& point, const Places& places,
                       const Bounce<double>* bounces) const {
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const glm::dvec3& x = places[i];
    const glm::dvec3 from = i > 0 ? places[i - 1] : eye_;
    const glm::dvec3 back = from - x;
    const glm::dvec3 ahead = (i == lastTurn() ? point : places[i + 1]) - x;
    if (glm::length(ahead) < kOffSurface * sizes_[i]) return false;
    if (options_.order == Order::Auto && smooth_[i] && surelyTurns(i, bounces[i], x, back, ahead))
      continue;
    const auto normal = implicit::normalAt(*turns_[i].surface, x);
    if (!normal) return false;
    const Turn& turn = turns_[i];
    const double towardsFrom = glm::dot(*normal, back);
    if (!(towardsFrom * glm::dot(*normal, ahead) * (turn.through ? -1.0 : 1.0) > 0.0)) return false;
    // What is seen of the inside is seen through an opening
    if (!turn.inside && towardsFrom < 0.0 && !insideShows(i, from, x)) return false;
    if (options_.order == Order::Nearest) continue;  // is where it is, however wrong
    const glm::dvec3 onward = onwards(turn, glm::normalize(-back), *normal);
    if (onward == glm::dvec3(0.0) ||
        !(glm::length(glm::cross(onward, glm::normalize(ahead))) < kWildPerturbation))
      return false;
  }
  return true;
}

void Reflector::add(const glm::dvec3& point, const Places& places, const glm::dvec3& from,
                    Starts& starts, Reflections& result, PathCounts& counts) const {
  const glm::dvec3& x = places[0];
  for (std::uint32_t i = 0; i < result.count; ++i) {
    const double apart = glm::distance(result.at[i].x, x);
    if (apart <= kSameReflection * glm::distance(starts[i], from) ||
        pixels(x, apart) < 10.0 * static_cast<double>(options_.errorPixels))
      return;
  }
  if (result.count == kMaxReflections) {
    ++counts.leftOut;
    return;
  }
  starts[result.count] = from;
  // The virtual vertex [Chen2000] Fig. 7, as virtualVertex()
  Reflection& reflection = result.at[result.count++];
  reflection.x = x;
  reflection.last = places[lastTurn()];
  const double seen = glm::distance(x, eye_);
  double reflected = 0.0;
  for (std::size_t i = 0; i < lastTurn(); ++i)
    reflected += turns_[i].indexAfter * glm::distance(places[i], places[i + 1]);
  const double ahead = turns_.back().indexAfter * glm::distance(reflection.last, point);
  reflection.image = x + (reflected + ahead) / seen * (x - eye_);
  reflection.share = (seen + reflected) / (seen + reflected + ahead);
}

bool Reflector::trace(const glm::dvec3& point, Places& places, PathCounts& counts,
                      Traced* traced) const {
  // In a lens' focus neighbouring points have far other paths
  if (refracts()) traced = nullptr;
  if (const Path* path = traced ? moveTraced(point, *traced, places) : nullptr) {
    ++counts.quadratic;
    return accept(point, places, path->bounces.data());
  }
  ++counts.retraced;
  return retrace(point, places, traced);
}

Reflections Reflector::reflectionsOf(const glm::dvec3& point, bool own, RayOctree::Cursor& cursor,
                                     PathCounts& counts, Traced* traced) const {
  Reflections result;
  const std::vector<std::uint32_t>& numbers = own ? selfRays_ : rays_;
  if (numbers.empty()) return result;
  std::vector<NearRay>& nearest = cursor.found;
  const RayOctree& octree = own ? selfOctree_ : octree_;
  if (options_.groups) {
    octree.nearest(point, cursor, nearest);
  } else {
    octree.reflections(point, cursor, nearest);
  }
  const GroupLimits limits{static_cast<double>(options_.groupAngleRad),
                           static_cast<double>(options_.groupDistance) * size_};
  std::vector<std::uint32_t>& tried = cursor.near;
  if (options_.groups) {
    tried = groupRepresentatives(octree.rays(), nearest, limits);
  } else {
    tried.clear();
    for (const NearRay& near : nearest) tried.push_back(near.ray);
  }
  Starts starts;
  for (const std::uint32_t ray : tried) {
    const std::size_t number = numbers[ray] * turns_.size();
    const Bounce<double>* bounces = &bounces_[number];
    const double* distances = &distances_[number];
    const glm::dvec3 direction = octree.rays()[ray].direction;
    const glm::dvec3 leaves = pointOf(bounces[lastTurn()].x);
    const double rho = std::max(0.0, glm::dot(point - leaves, direction));
    Places places;
    for (std::size_t i = 0; i < turns_.size(); ++i) places[i] = pointOf(bounces[i].x);
    const glm::dvec3 start = places[0];
    bool found = true;
    bool accepted = false;
    if (options_.order != Order::Nearest) {
      found = movable(bounces, rho);
      const glm::dvec3 step = point - (leaves + rho * direction);
      Places first = places;
      Places second = places;
      if (found) move(bounces, distances, rho, step, first, second);
      if (options_.order == Order::Auto) {
        // The remainder as the next term of a geometric series
        const double d1 = glm::distance(first[0], start);
        const double d2 = glm::distance(second[0], first[0]);
        const double allowed = static_cast<double>(options_.errorPixels) / pixels(start, 1.0);
        if (found && d2 < allowed) {
          places = first;
          ++counts.linear;
        } else if (found && d2 * d2 < allowed * d1) {
          places = second;
          ++counts.quadratic;
        } else {
          const double longest = kLongestStep * sizes_[0];
          if (found && d1 < longest && d2 < 0.5 * d1) places = second;
          accepted = found = trace(point, places, counts, traced);
        }
      } else {
        places = options_.order == Order::Linear ? first : second;
      }
    }
    if (found && (accepted || accept(point, places, bounces))) {
      add(point, places, start, starts, result, counts);
    } else {
      ++counts.notConverged;
    }
  }
  return result;
}

void Reflector::addReflectionsNear(const glm::dvec3& point, const Reflections& known,
                                   Reflections& result, PathCounts& counts, Traced* traced) const {
  Starts starts;
  for (std::uint32_t i = 0; i < result.count; ++i) starts[i] = result.at[i].x;
  for (std::uint32_t i = 0; i < known.count; ++i) {
    const glm::dvec3 start = known.at[i].x;
    Places places;
    places[0] = start;
    if (trace(point, places, counts, traced)) {
      add(point, places, start, starts, result, counts);
    } else {
      ++counts.notConverged;
    }
  }
}

bool Reflector::insideShows(std::size_t turn, const glm::dvec3& from, const glm::dvec3& x) const {
  const glm::dvec3 way = x - from;
  const double hit = hiddenAt(turn, from, from + (1.0 + kOffSurface) * way) * (1.0 + kOffSurface);
  if (!(hit > 1.0 - kOffSurface && hit < 1.0 + kOffSurface)) return false;
  const auto normal = implicit::normalAt(*turns_[turn].surface, from + hit * way);
  return normal && glm::dot(*normal, way) > 0.0;
}

double Reflector::hiddenAt(std::size_t turn, const glm::dvec3& from,
                           const glm::dvec3& point) const {
  const glm::dvec3 way = point - from;
  // Away from a surface that it has just left, as in pathBy()
  const bool leaves = turn > 0 && turns_[turn].surface == turns_[turn - 1].surface;
  const double start = leaves ? kOffSurface * sizes_[turn] / glm::length(way) : 0.0;
  if (!(start < 1.0)) return 1.0;
  const implicit::SurfaceHit hit =
      implicit::firstHit(*turns_[turn].surface, {from, way, start, 1.0});
  return hit.status == implicit::HitStatus::Hit ? hit.t : 1.0;
}

std::optional<Reflection> Reflector::hidden(const glm::dvec3& point, RayOctree::Cursor& cursor,
                                            PathCounts& counts, Traced* traced) const {
  if (!hides()) return std::nullopt;
  if (!before_) {
    const double share = hiddenAt(0, eye_, point);
    if (!(share < 1.0)) return std::nullopt;
    return Reflection{point, point, point, share};
  }
  const Reflections seen = before_->reflectionsOf(point, false, cursor, counts, traced);
  for (std::uint32_t i = 0; i < seen.count; ++i) {
    Reflection reflection = seen.at[i];
    const double share = hiddenAt(lastTurn(), reflection.last, point);
    if (!(share < 1.0)) continue;
    reflection.share += share * (1.0 - reflection.share);
    return reflection;
  }
  return std::nullopt;
}

}  // namespace catoptric::methods::perturbation
