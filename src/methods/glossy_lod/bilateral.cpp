#include "methods/glossy_lod/bilateral.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <span>

#include "core/parallel.h"
#include "methods/shared/sample_points.h"
#include "scene/reflectance.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Samples along an edge of the square that shares out a lobe.
constexpr int kShared = 4;
/// Neighbours on each side. With half the weight at both ends, each of the square's samples counts
/// alike, whichever is in the middle.
constexpr int kReach = kShared / 2;
/// How much of its mean of 1 - cosine a lobe's axis may be off, where a neighbour no longer counts,
/// times the root of its rays: what rays leave to be desired falls so, too. Ours.
constexpr float kOverlap = 2.0f;
/// Part by which exponents of neighbours may differ. Ours.
constexpr float kSameLobe = 0.2f;

std::size_t indexOf(const SampleTiles::Members& members, std::size_t k, int width) {
  return std::size_t{members.y[k]} * static_cast<std::size_t>(width) + members.x[k];
}

}  // namespace

/// Of a row's samples.
struct Bilateral::Sums {
  std::vector<float> radiance[3];
  std::vector<float> weight;

  explicit Sums(std::size_t width) : weight(width) {
    for (std::vector<float>& component : radiance) component.resize(width);
  }
  void clear() {
    for (std::vector<float>& component : radiance) std::ranges::fill(component, 0.0f);
    std::ranges::fill(weight, 0.0f);
  }
};

void Bilateral::begin(int width, int height) {
  width_ = width;
  height_ = height;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (std::size_t i = 0; i < 3; ++i) {
    position_[i].resize(count);
    axis_[i].resize(count);
    radiance_[i].resize(count);
  }
  nearness_.resize(count);
  object_.resize(count);
  image_.resize(4 * count);
  sharpness_.assign(count, 0.0f);
}

void Bilateral::interleave(const SampleTiles::Members& members, trace::PointLanes& points) {
  for (std::size_t k = 0; k < members.count; ++k) {
    const Vec2 shift =
        lobeShift(members.y[k] % kShared * kShared + members.x[k] % kShared, kShared);
    points.shiftX[k] = shift.x;
    points.shiftY[k] = shift.y;
  }
}

void Bilateral::keep(const SampleTiles::Members& members, const trace::PointLanes& points,
                     const float* nearness) {
  for (std::size_t k = 0; k < members.count; ++k) {
    if (points.glossiness[k] <= scene::kMirrorGlossiness) continue;
    const std::size_t at = indexOf(members, k, width_);
    const Vec3 position = points.position.at(k);
    const Vec3 axis = points.axis.at(k);
    for (int i = 0; i < 3; ++i) {
      position_[i][at] = position[i];
      axis_[i][at] = axis[i];
    }
    nearness_[at] = nearness[k];
    sharpness_[at] = scene::phongExponentFromGlossiness(points.glossiness[k]) + 2.0f;
    object_[at] = static_cast<float>(points.object[k]);
  }
}

std::uint64_t Bilateral::run(raster::GBuffer& gbuffer, int rays) {
  overlap_ = kOverlap / std::sqrt(static_cast<float>(rays));
  gbuffer.reflection.readRows(0, height_, GL_RGBA, GL_FLOAT,
                              std::as_writable_bytes(std::span(image_)));
  parallelFor(nearness_.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at)
      for (std::size_t i = 0; i < 3; ++i) radiance_[i][at] = image_[4 * at + i];
  });
  std::uint64_t filtered = 0;
  std::mutex mutex;
  parallelFor(static_cast<std::size_t>(height_), 4, [&](std::size_t begin, std::size_t end) {
    Sums sums(static_cast<std::size_t>(width_));
    std::uint64_t mine = 0;
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      sums.clear();
      const int last = std::min(height_ - 1, row + kReach);
      for (int y = std::max(0, row - kReach); y <= last; ++y)
        for (int dx = -kReach; dx <= kReach; ++dx) addNeighbours(row, dx, y - row, sums);
      mine += writeRow(row, sums);
    }
    const std::scoped_lock lock(mutex);
    filtered += mine;
  });
  gbuffer.reflection.uploadRows(0, height_, GL_RGBA, GL_FLOAT, image_.data());
  return filtered;
}

void Bilateral::addNeighbours(int row, int dx, int dy, Sums& sums) const {
  const auto partOf = [](int d) { return d == kReach || d == -kReach ? 0.5f : 1.0f; };
  const float part = partOf(dx) * partOf(dy);
  const std::ptrdiff_t here = std::ptrdiff_t{row} * width_;
  const std::ptrdiff_t there = here + std::ptrdiff_t{dy} * width_ + dx;
  const auto of = [](const std::vector<float>& values, std::ptrdiff_t first) {
    return values.data() + first;
  };
  const float* const px = of(position_[0], here);
  const float* const py = of(position_[1], here);
  const float* const pz = of(position_[2], here);
  const float* const rx = of(axis_[0], here);
  const float* const ry = of(axis_[1], here);
  const float* const rz = of(axis_[2], here);
  const float* const near = of(nearness_, here);
  const float* const sharp = of(sharpness_, here);
  const float* const object = of(object_, here);
  const float* const qx = of(position_[0], there);
  const float* const qy = of(position_[1], there);
  const float* const qz = of(position_[2], there);
  const float* const sx = of(axis_[0], there);
  const float* const sy = of(axis_[1], there);
  const float* const sz = of(axis_[2], there);
  const float* const otherSharp = of(sharpness_, there);
  const float* const otherObject = of(object_, there);
  const float* const red = of(radiance_[0], there);
  const float* const green = of(radiance_[1], there);
  const float* const blue = of(radiance_[2], there);
  float* const sumRed = sums.radiance[0].data();
  float* const sumGreen = sums.radiance[1].data();
  float* const sumBlue = sums.radiance[2].data();
  float* const weight = sums.weight.data();
  const float overlap = overlap_;
  const int end = std::min(width_, width_ - dx);
  for (int x = std::max(0, -dx); x < end; ++x) {
    // What the lobe's axis sees, from the neighbour: how far it is off the axis there
    const float vx = rx[x] + (px[x] - qx[x]) * near[x];
    const float vy = ry[x] + (py[x] - qy[x]) * near[x];
    const float vz = rz[x] + (pz[x] - qz[x]) * near[x];
    const float along = vx * sx[x] + vy * sy[x] + vz * sz[x];
    const float ax = vx - along * sx[x];
    const float ay = vy - along * sy[x];
    const float az = vz - along * sz[x];
    const float off = 0.5f * (ax * ax + ay * ay + az * az);
    const float bound = overlap * along * along;
    const float sharper = std::max(sharp[x], otherSharp[x]);
    const float rest = std::max(0.0f, bound - off * sharper);
    const float ratio = rest / std::max(bound, 1e-30f);
    const bool alike = (object[x] == otherObject[x]) & (along > 0.0f) &
                       (sharper - std::min(sharp[x], otherSharp[x]) <= kSameLobe * sharper) &
                       (otherSharp[x] > 0.0f);
    const float w = alike ? part * ratio * ratio : 0.0f;
    sumRed[x] += w * red[x];
    sumGreen[x] += w * green[x];
    sumBlue[x] += w * blue[x];
    weight[x] += w;
  }
}

std::uint64_t Bilateral::writeRow(int row, const Sums& sums) {
  std::uint64_t filtered = 0;
  const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
  for (std::size_t x = 0; x < sums.weight.size(); ++x) {
    // 1 is the sample's own
    if (!(sharpness_[first + x] > 0.0f) || !(sums.weight[x] > 1.0f)) continue;
    ++filtered;
    for (std::size_t i = 0; i < 3; ++i)
      image_[4 * (first + x) + i] = sums.radiance[i][x] / sums.weight[x];
  }
  return filtered;
}

}  // namespace catoptric::methods::glossy_lod
