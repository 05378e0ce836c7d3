// The sampled paths of a sequence of reflectors: where they are taken, and the octree of their
// rays.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "methods/perturbation/reflector.h"
#include "scene/implicit/surface.h"

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

class Reflector::Sampling {
 public:
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

  Sampling(Reflector& reflector, const View& view) : reflector_(reflector), view_(view) {}

  /// One sample in the middle of each square of `spacing` pixels; `again`: of paths that meet the
  /// last reflector again.
  Grid sample(const std::array<float, 4>& seen, float spacing, bool again) const;
  /// A grid of thirds, with more samples where neighbouring paths tell too little of each other.
  Grid refined(const Grid& coarse, const std::array<float, 4>& seen, float spacing) const;
  /// Keeps a grid's paths. Rays of self paths lie about the hit, not the start, which is on the
  /// reflector too.
  RayOctree makeOctree(const Grid& grid, const Box3& box, std::vector<std::uint32_t>& paths);

 private:
  /// Adds samples in the middle of those squares of a grid that are asked for.
  void addSamples(Grid& grid, const std::array<float, 4>& seen, float spacing, bool again,
                  std::span<const std::size_t> squares) const;

  Reflector& reflector_;
  const View& view_;
};

void Reflector::Sampling::addSamples(Grid& grid, const std::array<float, 4>& seen, float spacing,
                                     bool again, std::span<const std::size_t> squares) const {
  std::vector<std::unique_ptr<Sample>> samples(squares.size());
  std::atomic<std::uint64_t> total{0};
  parallelFor(squares.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t column = squares[i] % static_cast<std::size_t>(grid.width);
      const std::size_t row = squares[i] / static_cast<std::size_t>(grid.width);
      const glm::dvec3 d(
          scene::rayDirection(view_.camera, view_.width, view_.height,
                              seen[0] + (static_cast<float>(column) + 0.5f) * spacing,
                              seen[1] + (static_cast<float>(row) + 0.5f) * spacing));
      const implicit::SurfaceHit hit =
          implicit::firstHit(*reflector_.turns_[0].surface, {reflector_.eye_, d});
      if (hit.status != implicit::HitStatus::Hit) continue;
      Sample found;
      const PathSearch path = reflector_.pathBy(reflector_.eye_ + hit.t * d, found.path);
      if (path == PathSearch::TotalReflection) ++total;
      if (path != PathSearch::Path || !reflector_.movable(found.path.bounces.data(), 0.0)) continue;
      if (reflector_.turns_.back().total() && reflector_.wouldLeave(found.path)) continue;
      if (again) {
        const implicit::SurfaceHit next =
            implicit::firstHit(*reflector_.turns_.back().surface,
                               {found.path.place(reflector_.lastTurn()), found.path.direction,
                                kOffSurface * reflector_.size_});
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
}

Reflector::Sampling::Grid Reflector::Sampling::sample(const std::array<float, 4>& seen,
                                                      float spacing, bool again) const {
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
}

Reflector::Sampling::Grid Reflector::Sampling::refined(const Grid& coarse,
                                                       const std::array<float, 4>& seen,
                                                       float spacing) const {
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
        differs =
            differs || (other != kNoRay && other != own &&
                        reflector_.unlike(coarse.samples[own].path, coarse.samples[other].path));
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
}

RayOctree Reflector::Sampling::makeOctree(const Grid& grid, const Box3& box,
                                          std::vector<std::uint32_t>& paths) {
  std::vector<SampleRay> rays;
  for (const Sample& found : grid.samples) {
    const Path& path = found.path;
    paths.push_back(static_cast<std::uint32_t>(reflector_.pathCount_++));
    const auto count = static_cast<std::ptrdiff_t>(reflector_.turns_.size());
    reflector_.bounces_.insert(reflector_.bounces_.end(), path.bounces.begin(),
                               path.bounces.begin() + count);
    reflector_.distances_.insert(reflector_.distances_.end(), path.distances.begin(),
                                 path.distances.begin() + count);
    SampleRay ray{path.place(reflector_.lastTurn()) + 0.5 * found.self * path.direction,
                  path.direction};
    if (found.self > 0.0) ray.length = found.self;
    rays.push_back(ray);
  }
  std::vector<Neighbours> neighbours;
  if (!reflector_.options_.groups)
    neighbours = gridNeighbours(grid.width, grid.height, grid.sampleAt);
  return RayOctree(std::move(rays), glm::dvec3(box.min), glm::dvec3(box.max),
                   {.k = static_cast<std::size_t>(reflector_.options_.candidates)},
                   std::move(neighbours));
}

void Reflector::samplePaths(const View& view, const Box3& scene) {
  Sampling sampling(*this, view);
  std::array<float, 4> seen = seenRectangle(turns_[0].bounds, view);
  auto spacing = static_cast<float>(options_.sampleSpacing);
  if (refracts()) spacing = std::max(1.0f, kRefractedSpacing * spacing);
  Sampling::Grid grid = sampling.sample(seen, spacing, false);
  while (grid.count() < options_.fewestPaths && spacing >= 2.0f && !grid.sampleAt.empty()) {
    if (turns_.size() > 1) {
      // The later reflectors fill a part of the first: look there, and give up soon
      if (grid.count() == 0 && spacing <= 0.5f * static_cast<float>(options_.sampleSpacing)) break;
      if (grid.count() > 0) seen = filledPart(grid.sampleAt, grid.width, seen, spacing);
    }
    spacing *= 0.5f;
    grid = sampling.sample(seen, spacing, false);
  }
  if (grid.count() == 0) {
    if (const auto image = imageOfLast(view)) {
      seen = *image;
      const float across = std::max(seen[2] - seen[0], seen[3] - seen[1]);
      spacing = std::clamp(across / kImageSamples, kImageSpacing, spacing);
      grid = sampling.sample(seen, spacing, false);
      missed_ = grid.count() == 0;
    }
  }
  totalReflections_ = grid.total;
  if (grid.count() == 0) return;
  if (options_.order == Order::Auto && spacing >= kThirds && !refracts())
    grid = sampling.refined(grid, seen, spacing);
  octree_ = sampling.makeOctree(grid, scene, rays_);
  const Sampling::Grid self = sampling.sample(seen, std::max(1.0f, kSelfSpacing * spacing), true);
  if (self.count() > 0) selfOctree_ = sampling.makeOctree(self, turns_.back().bounds, selfRays_);
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

}  // namespace catoptric::methods::perturbation
