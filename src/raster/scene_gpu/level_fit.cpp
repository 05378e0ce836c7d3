#include "raster/scene_gpu/level_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "core/srgb.h"

namespace catoptric::raster {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;
/// Steps from triangle to triangle while a point is sought. Ours: more than any needed.
constexpr int kMostSteps = 16;
/// Points as near to a triangle as this share of the object's extent lie on it. Ours.
constexpr float kExact = 1e-6f;
/// Points farther from their level than this many times the root mean square are sought again among
/// more triangles. Ours.
constexpr double kFar = 2.0;
/// A level is fitted to so many points for each of its vertices, or to all. Ours.
constexpr std::size_t kPointsPerVertex = 4;
/// Conjugate gradients end after so many steps: masses are well conditioned. Ours.
constexpr int kFitSteps = 12;
/// Pull of a vertex towards its own attributes, beside that of points all over its triangles. Where
/// there are hardly any it prevails, so that no vertex is extrapolated from far away. Ours.
constexpr float kOwnShare = 0.01f;
/// A fitted normal that turns farther than this (as a cosine) from the vertex's own is not taken.
constexpr float kLeastNormalCosine = 0.5f;

/// What is interpolated over a triangle: bake, colour, normal, both sets of texture coordinates.
constexpr std::size_t kChannels = 14;
constexpr std::size_t kBake = 0;
constexpr std::size_t kColor = 4;
constexpr std::size_t kNormal = 7;
constexpr std::size_t kUv0 = 10;
constexpr std::size_t kUv1 = 12;
using Channels = std::array<float, kChannels>;

Channels channelsOf(const frame::VertexAttributes& a) {
  return {a.bake.x,   a.bake.y,   a.bake.z,   a.bake.w, a.color.x, a.color.y, a.color.z,
          a.normal.x, a.normal.y, a.normal.z, a.uv0.x,  a.uv0.y,   a.uv1.x,   a.uv1.y};
}

frame::VertexAttributes attributesOf(const Channels& c, frame::VertexAttributes result) {
  result.bake = {c[kBake], c[kBake + 1], c[kBake + 2], c[kBake + 3]};
  result.color = {c[kColor], c[kColor + 1], c[kColor + 2]};
  result.normal = {c[kNormal], c[kNormal + 1], c[kNormal + 2]};
  result.uv0 = {c[kUv0], c[kUv0 + 1]};
  result.uv1 = {c[kUv1], c[kUv1 + 1]};
  return result;
}

void add(Channels& sum, float factor, const Channels& values) {
  for (std::size_t c = 0; c < kChannels; ++c) sum[c] += factor * values[c];
}

/// Barycentric coordinates of the point of a triangle nearest to `p` (by the regions of Ericson,
/// Real-Time Collision Detection, 5.1.5).
Vec3 nearestPlace(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const float d1 = glm::dot(ab, p - a);
  const float d2 = glm::dot(ac, p - a);
  if (d1 <= 0.0f && d2 <= 0.0f) return {1.0f, 0.0f, 0.0f};
  const float d3 = glm::dot(ab, p - b);
  const float d4 = glm::dot(ac, p - b);
  if (d3 >= 0.0f && d4 <= d3) return {0.0f, 1.0f, 0.0f};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
    const float v = d1 / (d1 - d3);
    return {1.0f - v, v, 0.0f};
  }
  const float d5 = glm::dot(ab, p - c);
  const float d6 = glm::dot(ac, p - c);
  if (d6 >= 0.0f && d5 <= d6) return {0.0f, 0.0f, 1.0f};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
    const float w = d2 / (d2 - d6);
    return {1.0f - w, 0.0f, w};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0f, 1.0f - w, w};
  }
  const float sum = va + vb + vc;
  if (!(sum > 0.0f)) return {1.0f, 0.0f, 0.0f};
  return {1.0f - vb / sum - vc / sum, vb / sum, vc / sum};
}

/// Vertex attributes that come nearest to those of points on triangles, all channels at once: the
/// normal equations of sum w |interpolated - own|^2, by conjugate gradients.
class LeastSquares {
 public:
  /// `areas`: of the triangles, in the unit of the points' weights.
  LeastSquares(std::span<const std::uint32_t> indices, std::span<const float> areas,
               std::span<const frame::VertexAttributes> now) {
    std::vector<std::uint32_t> number(now.size(), kNone);
    for (const std::uint32_t vertex : indices) {
      if (number[vertex] == kNone) {
        number[vertex] = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back(vertex);
        x_.push_back(channelsOf(now[vertex]));
      }
      corners_.push_back(number[vertex]);
    }
    least_ = most_ = x_;
    mass_.resize(indices.size() / 3);
    residual_.resize(vertices_.size());
    own_.resize(vertices_.size());
    // Points all over a triangle give each of its corners a sixth of its area
    for (std::size_t i = 0; i < corners_.size(); ++i)
      own_[corners_[i]] += kOwnShare / 6.0f * areas[i / 3];
    diagonal_ = own_;
  }

  /// A point at a place of a triangle, and the attributes that are to be seen there.
  void add(std::uint32_t triangle, const Vec3& place, float weight,
           const frame::VertexAttributes& attributes) {
    const Channels own = channelsOf(attributes);
    const std::uint32_t* corners = &corners_[3 * triangle];
    Channels off = own;
    for (int k = 0; k < 3; ++k) raster::add(off, -place[k], x_[corners[k]]);
    mass_[triangle] += weight * glm::outerProduct(place, place);
    for (int k = 0; k < 3; ++k) {
      const float share = weight * place[k];
      if (!(share > 0.0f)) continue;
      const std::uint32_t v = corners[k];
      raster::add(residual_[v], share, off);
      diagonal_[v] += share * place[k];
      for (std::size_t c = 0; c < kChannels; ++c) {
        least_[v][c] = std::min(least_[v][c], own[c]);
        most_[v][c] = std::max(most_[v][c], own[c]);
      }
    }
  }

  void solve(std::span<frame::VertexAttributes> now) {
    std::vector<Channels> direction(vertices_.size(), Channels{});
    std::vector<Channels> image(vertices_.size());
    Sums before{};
    for (int n = 0; n < kFitSteps; ++n) {
      const Sums energy = advance(before, direction);
      before = energy;
      multiply(direction, image);
      Sums along{};
      for (std::size_t v = 0; v < image.size(); ++v) {
        for (std::size_t c = 0; c < kChannels; ++c)
          along[c] += static_cast<double>(direction[v][c]) * image[v][c];
      }
      for (std::size_t v = 0; v < image.size(); ++v) {
        for (std::size_t c = 0; c < kChannels; ++c) {
          const float a = along[c] > 0.0 ? static_cast<float>(energy[c] / along[c]) : 0.0f;
          x_[v][c] += a * direction[v][c];
          residual_[v][c] -= a * image[v][c];
        }
      }
    }
    take(now);
  }

 private:
  using Sums = std::array<double, kChannels>;

  float preconditioned(std::size_t v, std::size_t c) const {
    return diagonal_[v] > 0.0f ? residual_[v][c] / diagonal_[v] : 0.0f;
  }

  /// The next conjugate direction; returns the residual's energy.
  Sums advance(const Sums& before, std::vector<Channels>& direction) const {
    Sums energy{};
    for (std::size_t v = 0; v < direction.size(); ++v) {
      for (std::size_t c = 0; c < kChannels; ++c)
        energy[c] += static_cast<double>(residual_[v][c]) * preconditioned(v, c);
    }
    for (std::size_t v = 0; v < direction.size(); ++v) {
      for (std::size_t c = 0; c < kChannels; ++c) {
        const float b = before[c] > 0.0 ? static_cast<float>(energy[c] / before[c]) : 0.0f;
        direction[v][c] = preconditioned(v, c) + b * direction[v][c];
      }
    }
    return energy;
  }

  void multiply(const std::vector<Channels>& direction, std::vector<Channels>& image) const {
    for (std::size_t v = 0; v < image.size(); ++v) {
      for (std::size_t c = 0; c < kChannels; ++c) image[v][c] = own_[v] * direction[v][c];
    }
    for (std::size_t t = 0; t < mass_.size(); ++t) {
      const std::uint32_t* corners = &corners_[3 * t];
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          raster::add(image[corners[i]], mass_[t][i][j], direction[corners[j]]);
      }
    }
  }

  /// No brighter, no darker than anything that a vertex stands for.
  void take(std::span<frame::VertexAttributes> now) {
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      frame::VertexAttributes& mine = now[vertices_[v]];
      for (std::size_t c = 0; c < kNormal; ++c)
        x_[v][c] = std::clamp(x_[v][c], least_[v][c], most_[v][c]);
      frame::VertexAttributes fitted = attributesOf(x_[v], mine);
      fitted.normal = normalizedOr(fitted.normal, mine.normal);
      if (!(glm::dot(fitted.normal, mine.normal) >= kLeastNormalCosine))
        fitted.normal = mine.normal;
      mine = fitted;
    }
  }

  std::vector<std::uint32_t> vertices_;
  std::vector<std::uint32_t> corners_;  ///< three for each triangle, numbers in vertices_
  std::vector<Mat3> mass_;              ///< of each triangle: sum of w b b^T
  std::vector<Channels> x_, residual_, least_, most_;
  std::vector<float> own_, diagonal_;
};

/// Display steps of a linear value, from a table by its square root, which is nearly straight.
float step(float linear) {
  constexpr std::size_t kSpans = 256;
  static const std::array<float, kSpans + 2> kTable = [] {
    std::array<float, kSpans + 2> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
      const double root = std::min(1.0, static_cast<double>(i) / kSpans);
      table[i] = static_cast<float>(255.0 * srgbFromLinear(root * root));
    }
    return table;
  }();
  const float place = kSpans * std::sqrt(std::clamp(linear, 0.0f, 1.0f));
  const auto i = static_cast<std::size_t>(place);
  return kTable[i] + (place - static_cast<float>(i)) * (kTable[i + 1] - kTable[i]);
}

}  // namespace

LevelFit::LevelFit(const frame::Geometry& geometry, const frame::ObjectRange& range,
                   const LevelSource& source, const frame::Lighting& lighting)
    : geometry_(geometry), range_(range), source_(source), lighting_(lighting) {
  now_.assign(geometry.attributes.begin() + range.firstVertex,
              geometry.attributes.begin() + range.firstVertex + range.vertexCount);
  indices_.resize(range.indexCount);
  for (std::uint32_t i = 0; i < range.indexCount; ++i)
    indices_[i] = geometry.indices[range.firstIndex + i] - range.firstVertex;
  listIncident();
  std::vector<float> weight(range.vertexCount, 0.0f);
  for (std::size_t i = 0; i < indices_.size(); ++i) weight[indices_[i]] += area(i / 3) / 3.0f;
  for (std::uint32_t v = 0; v < range.vertexCount; ++v) {
    if (!(weight[v] > 0.0f)) continue;
    Point point{.vertex = v, .weight = weight[v], .triangle = trianglesOf(v).front()};
    point.distance2 = std::numeric_limits<float>::infinity();
    seek(point, v);
    points_.push_back(point);
    shown_.push_back(display(position(v), now_[v]));
  }
}

float LevelFit::area(std::size_t triangle) const {
  const Vec3& a = position(indices_[3 * triangle]);
  const Vec3 ab = position(indices_[3 * triangle + 1]) - a;
  const Vec3 ac = position(indices_[3 * triangle + 2]) - a;
  return 0.5f * glm::length(glm::cross(ab, ac));
}

Vec3 LevelFit::display(const Vec3& position, const frame::VertexAttributes& at) const {
  Vec3 irradiance(at.bake);
  const float length = glm::length(at.normal);
  if (length > 0.0f) {
    const Vec3 normal = at.normal / length;
    if (at.bake.w != 0.0f) {
      Vec3 sky = kPi * lighting_.ambient;
      if (lighting_.environment) sky += lighting_.environment->irradiance(normal);
      irradiance += at.bake.w * sky;
    }
    for (const frame::WorldLight& light : lighting_.lights)
      irradiance += frame::lightIrradiance(light, position, normal);
  }
  const Vec3 radiance = source_.albedo * at.color * irradiance * (1.0f / kPi);
  return {step(radiance.x), step(radiance.y), step(radiance.z)};
}

void LevelFit::listIncident() {
  firstIncident_.assign(range_.vertexCount + 1, 0);
  for (const std::uint32_t vertex : indices_) ++firstIncident_[vertex + 1];
  for (std::uint32_t v = 0; v < range_.vertexCount; ++v) firstIncident_[v + 1] += firstIncident_[v];
  incident_.resize(indices_.size());
  std::vector<std::uint32_t> next(firstIncident_.begin(), firstIncident_.end() - 1);
  for (std::size_t i = 0; i < indices_.size(); ++i)
    incident_[next[indices_[i]]++] = static_cast<std::uint32_t>(i / 3);
}

std::vector<std::uint32_t> LevelFit::survivors(std::span<const std::uint32_t> indices) const {
  std::vector<std::uint32_t> kept(range_.vertexCount, kNone);
  for (const std::uint32_t vertex : indices) kept[vertex] = vertex;
  // Ring by ring, over the triangles of the level before
  std::vector<std::uint32_t> open;
  for (std::uint32_t v = 0; v < range_.vertexCount; ++v) {
    if (kept[v] == kNone && !trianglesOf(v).empty()) open.push_back(v);
  }
  while (!open.empty()) {
    std::vector<std::uint32_t> left;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
    for (const std::uint32_t v : open) {
      std::uint32_t best = kNone;
      float least = std::numeric_limits<float>::infinity();
      for (const std::uint32_t triangle : trianglesOf(v)) {
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t other = kept[indices_[3 * triangle + k]];
          if (other == kNone) continue;
          const Vec3 offset = position(other) - position(v);
          const float distance2 = glm::dot(offset, offset);
          if (distance2 < least || (distance2 == least && other < best)) {
            least = distance2;
            best = other;
          }
        }
      }
      if (best == kNone) {
        left.push_back(v);
      } else {
        found.emplace_back(v, best);
      }
    }
    if (found.empty()) break;  // whole parts are gone
    for (const auto& [v, other] : found) kept[v] = other;
    open = std::move(left);
  }
  return kept;
}

void LevelFit::seek(Point& point, std::uint32_t vertex) const {
  const Vec3 p = position(point.vertex);
  for (const std::uint32_t triangle : trianglesOf(vertex)) {
    const std::array<Vec3, 3> corners{position(indices_[3 * triangle]),
                                      position(indices_[3 * triangle + 1]),
                                      position(indices_[3 * triangle + 2])};
    const Vec3 place = nearestPlace(p, corners[0], corners[1], corners[2]);
    const Vec3 offset = place.x * corners[0] + place.y * corners[1] + place.z * corners[2] - p;
    const float distance2 = glm::dot(offset, offset);
    if (distance2 < point.distance2) {
      point.triangle = triangle;
      point.barycentric = place;
      point.distance2 = distance2;
    }
  }
}

void LevelFit::thin() {
  // By well-mixed bits of their numbers, so that no pattern of the vertices is kept or lost
  const std::uint32_t bit = 1u << (thinned_++ % 32u);
  std::size_t left = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if ((mixedBits(points_[i].vertex) & bit) != 0) continue;
    points_[left] = points_[i];
    points_[left].weight *= 2.0f;
    shown_[left] = shown_[i];
    ++left;
  }
  points_.resize(left);
  shown_.resize(left);
}

void LevelFit::follow(std::span<const std::uint32_t> indices) {
  // A closed surface has half as many vertices as triangles
  while (points_.size() > kPointsPerVertex * indices.size() / 6) thin();
  const std::vector<std::uint32_t> kept = survivors(indices);
  const std::vector<std::uint32_t> before = std::move(indices_);
  indices_.assign(indices.begin(), indices.end());
  listIncident();
  const float exact = kExact * range_.bounds.diameter();
  const float exact2 = exact * exact;
  std::size_t found = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point point = points_[i];
    const std::uint32_t was = point.triangle;
    point.distance2 = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = kept[before[3 * was + k]];
      if (vertex != kNone) seek(point, vertex);
    }
    if (!std::isfinite(point.distance2)) continue;  // of a part that is gone
    for (int n = 0; n < kMostSteps && point.distance2 > exact2; ++n) {
      const std::uint32_t here = point.triangle;
      for (std::size_t k = 0; k < 3; ++k) seek(point, indices_[3 * here + k]);
      if (point.triangle == here) break;
    }
    points_[found] = point;
    shown_[found] = shown_[i];
    ++found;
  }
  points_.resize(found);
  shown_.resize(found);
  seekFarther();
  const auto own = geometry_.attributes.begin() + range_.firstVertex;
  now_.assign(own, own + range_.vertexCount);
}

void LevelFit::seekFarther() {
  double sum = 0.0;
  for (const Point& point : points_) sum += point.distance2;
  const double usual = sum / static_cast<double>(std::max<std::size_t>(points_.size(), 1));
  for (Point& point : points_) {
    // Where triangles without area were, the way from one to the next can be barred
    if (point.distance2 <= kFar * kFar * usual) continue;
    const std::uint32_t here = point.triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      for (const std::uint32_t near : trianglesOf(indices_[3 * here + k])) {
        for (std::size_t j = 0; j < 3; ++j) seek(point, indices_[3 * near + j]);
      }
    }
  }
}

LevelError LevelFit::error() const {
  double metres2 = 0.0;
  double steps2 = 0.0;
  double total = 0.0;
  const float metresPerUv =
      source_.textured && range_.uvPerMetre > 0.0f ? 1.0f / range_.uvPerMetre : 0.0f;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point& point = points_[i];
    Channels sum{};
    for (int k = 0; k < 3; ++k)
      add(sum, point.barycentric[k],
          channelsOf(now_[indices_[3 * point.triangle + static_cast<std::uint32_t>(k)]]));
    const frame::VertexAttributes seen = attributesOf(sum, {});
    const frame::VertexAttributes& own = geometry_.attributes[range_.firstVertex + point.vertex];
    const Vec3 difference = display(position(point.vertex), seen) - shown_[i];
    const double weight = point.weight;
    steps2 += weight * glm::dot(difference, difference) / 3.0;
    const Vec2 moved = (seen.uv0 - own.uv0) * metresPerUv;
    metres2 += weight * (point.distance2 + glm::dot(moved, moved));
    total += weight;
  }
  if (!(total > 0.0)) return {};
  return {.metres = static_cast<float>(std::sqrt(metres2 / total)),
          .steps = static_cast<float>(std::sqrt(steps2 / total))};
}

void LevelFit::fit() {
  std::vector<float> areas(indices_.size() / 3);
  for (std::size_t t = 0; t < areas.size(); ++t) areas[t] = area(t);
  LeastSquares equations(indices_, areas, now_);
  for (const Point& point : points_)
    equations.add(point.triangle, point.barycentric, point.weight,
                  geometry_.attributes[range_.firstVertex + point.vertex]);
  equations.solve(now_);
}

}  // namespace catoptric::raster
