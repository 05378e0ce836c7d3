#include "methods/glossy_lod/images/geometry_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <span>

#include "core/hash.h"
#include "core/parallel.h"
#include "methods/glossy_lod/images/cells.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// Where a border cannot have all of the mesh's edges, a run of them gets so many steps at the
/// least. Ours.
constexpr int kWantedSteps = 4;
/// For these a chart's grid may be finer by so many levels than its share of the quads. Ours.
constexpr int kFinerForBorder = 1;
/// More steps than any run of edges has.
constexpr int kAllSteps = 1 << kMostLevels;
/// Triangles of a chart that is traced as it is: those of a quad.
constexpr std::size_t kPlain = 2;

double areaOf(const MeshView& mesh, std::uint32_t t) {
  const glm::dvec3 a(mesh.positions[mesh.indices[3 * t]]);
  return 0.5 * glm::length(glm::cross(glm::dvec3(mesh.positions[mesh.indices[3 * t + 1]]) - a,
                                      glm::dvec3(mesh.positions[mesh.indices[3 * t + 2]]) - a));
}

Vec3 middleOf(const MeshView& mesh, std::uint32_t t) {
  const std::uint32_t* v = &mesh.indices[3 * std::size_t{t}];
  return (mesh.positions[v[0]] + mesh.positions[v[1]] + mesh.positions[v[2]]) / 3.0f;
}

/// FlatMesh::stretch() from which on a chart is cut in two. Ours: a rectangle of 1 x 12.
constexpr double kMostStretch = 2.5;
/// A mesh of which a chart has more triangles is cut into cells first: flattening takes longer than
/// in proportion to them. Ours.
constexpr std::size_t kMostTriangles = 1 << 15;
/// Triangles of a cell, about, and cells of a mesh at the least. Ours.
constexpr std::size_t kCellTriangles = 1 << 14;
constexpr std::size_t kLeastCells = 64;
/// A texel moves only if it comes so much nearer to its quad: not where this bridges a gap. Ours.
constexpr float kNearer = 0.5f;
/// Edges that a texel of the border moves across at the most. Ours.
constexpr int kMostSteps = 32;
/// Charts of so few triangles are not cut in two but into these. Ours.
constexpr std::size_t kSmallChart = 4;

/// A chart on its way: flat, with as many quads as it gets.
struct Prepared {
  /// Welded vertices at which the corners of its square lie; fewer where these cut edges.
  std::vector<std::uint32_t> corners;
  std::uint64_t outline = 0;  ///< of what it was flattened with: fingerprintOf()
  std::unique_ptr<FlatMesh> flat;
  bool failed = false;  ///< it cannot be flattened
  bool bad = false;     ///< it is to be cut
  bool plain = false;
  int level = 0;
  int texelLevel = 0;
  std::vector<TrianglePlace> inner;  ///< of the grid's vertices inside, (2^level - 1)^2
  std::vector<TrianglePlace> texels;
  double stretch = 1.0;
};

/// Of a chart's border: where its arcs run and end.
std::uint64_t fingerprintOf(const Outlines& outlines, const Chart& chart) {
  Fingerprint f;
  for (const ArcUse& use : chart.border) {
    f.addValue(use.forward);
    f.addArray(std::span<const std::uint32_t>(outlines.arcs[use.arc].vertices));
  }
  return f.value();
}

int levelOf(double quads, int most) {
  if (!(quads > 1.0)) return 0;
  return std::clamp(static_cast<int>(std::lround(0.5 * std::log2(quads))), 0, most);
}

int levelsIn(int most) {
  return std::bit_width(static_cast<unsigned>(most)) - 1;
}

/// Where the centres of a plain chart's texels lie, on the triangles that the traversal has.
std::vector<TrianglePlace> plainTexels(const Chart& chart, const FlatMesh& flat, int texelLevel) {
  const int n = 1 << texelLevel;
  std::vector<TrianglePlace> texels;
  texels.reserve(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      double u = (x + 0.5) / n;
      double v = (y + 0.5) / n;
      bool lower = u + v < 1.0;
      // Of one triangle, that half has no area: it mirrors the other one
      if (lower && chart.triangles.size() == 1) {
        lower = false;
        const double mirrored = 1.0 - v;
        v = 1.0 - u;
        u = mirrored;
      }
      texels.push_back(lower ? flat.onHalf(true, u, v) : flat.onHalf(false, 1.0 - u, 1.0 - v));
    }
  }
  return texels;
}

/// Flattens a chart; `share`: as many quads and texels as it is to have, about.
void flatten(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
             std::size_t index, const ImageSize& share, Prepared& made) {
  const Chart& chart = outlines.charts[index];
  made.outline = fingerprintOf(outlines, chart);
  made.plain = chart.triangles.size() <= kPlain;
  made.failed = true;
  if (!chart.simple) return;
  made.flat = std::make_unique<FlatMesh>(mesh, topology, outlines, index);
  FlatMesh& flat = *made.flat;
  const std::vector<std::uint32_t>& corners = made.corners;
  if (corners.size() == 4 && !made.plain) {
    flat.placeCorners({corners[0], corners[1], corners[2], corners[3]});
  } else {
    flat.placeCorners();
  }
  const int most = levelsIn(share.most);
  const int level = made.plain ? 0 : levelOf(share.quads, most);
  for (const int wanted : {made.plain ? 1 : kAllSteps, kWantedSteps, 1}) {
    const int finer = wanted == 1 ? most : wanted == kAllSteps ? level : level + kFinerForBorder;
    for (int l = level; l <= std::min(finer, most) && made.failed; ++l)
      made.failed = !flat.giveSteps(l, wanted);
    if (!made.failed) break;
  }
  if (made.failed) return;
  made.level = flat.level();
  const double texels = share.texels > 0.0 ? share.texels : share.quads;
  made.texelLevel = made.plain ? levelOf(texels, most) : made.level;
  if (made.plain) return;
  made.failed = !flat.flatten();
  if (made.failed) return;
  made.stretch = flat.stretch();
  // Stretched texels are as fine where they are long
  if (share.texels > 0.0)
    made.texelLevel = std::max(made.level, levelOf(texels * made.stretch * made.stretch, most));
}

/// Finds the places of a flat chart's vertices and texels.
void resample(const Chart& chart, Prepared& made) {
  if (made.plain) {
    made.texels = plainTexels(chart, *made.flat, made.texelLevel);
    return;
  }
  const int n = 1 << made.level;
  const int texels = 1 << made.texelLevel;
  made.inner = made.flat->placesAt(n, 0.0, 1, n - 1);
  made.texels = made.flat->placesAt(texels, 0.5, 0, texels);
  made.failed = made.texels.empty() || (n > 1 && made.inner.empty());
}

/// The common border's vertices, as many as the coarser of its charts has room for.
class Borders {
 public:
  Borders(const MeshView& mesh, const Outlines& outlines, const std::vector<Prepared>& charts,
          ObjectImage& image)
      : mesh_(mesh), outlines_(outlines), image_(image), ofArc_(outlines.arcs.size()) {
    std::vector<int> steps(outlines.arcs.size(), 1 << 30);
    for (std::size_t c = 0; c < charts.size(); ++c) {
      std::vector<int> ofUse(outlines.charts[c].border.size(), 0);
      for (const BorderPiece& piece : charts[c].flat->pieces()) ofUse[piece.use] += piece.steps;
      for (std::size_t use = 0; use < ofUse.size(); ++use) {
        int& least = steps[outlines.charts[c].border[use].arc];
        least = std::min(least, ofUse[use]);
      }
    }
    vertexSample_.assign(mesh.positions.size(), ~0u);
    for (std::size_t a = 0; a < ofArc_.size(); ++a) ofArc_[a] = samplesOf(a, steps[a]);
  }

  /// The sample at step `step` of `steps` along a chart's passage.
  std::uint32_t at(const ArcUse& use, int step, int steps) const {
    const std::vector<std::uint32_t>& samples = ofArc_[use.arc];
    const std::int64_t n = static_cast<std::int64_t>(samples.size()) - 1;
    const std::int64_t k = (2 * n * step + steps) / (2 * std::int64_t{steps});
    return samples[static_cast<std::size_t>(use.forward ? k : n - k)];
  }

 private:
  std::uint32_t ofVertex(std::uint32_t v) {
    if (vertexSample_[v] == ~0u) {
      vertexSample_[v] = static_cast<std::uint32_t>(image_.samples.size());
      image_.samples.push_back({{v, v, v}, 0.0f, 0.0f});
    }
    return vertexSample_[v];
  }

  std::vector<std::uint32_t> samplesOf(std::size_t arc, int steps) {
    const std::vector<std::uint32_t>& line = outlines_.arcs[arc].vertices;
    const std::size_t edges = line.size() - 1;
    std::vector<double> metres;
    for (std::size_t e = 0; e < edges; ++e)
      metres.push_back(glm::distance(glm::dvec3(mesh_.positions[line[e]]),
                                     glm::dvec3(mesh_.positions[line[e + 1]])));
    std::vector<std::uint32_t> samples{ofVertex(line[0])};
    if (static_cast<std::size_t>(steps) >= edges) {
      const std::vector<int> given = shareSteps(steps, metres, std::vector<int>(edges, 1));
      for (std::size_t e = 0; e < edges; ++e) {
        for (int s = 1; s < given[e]; ++s) {
          samples.push_back(static_cast<std::uint32_t>(image_.samples.size()));
          image_.samples.push_back({{line[e], line[e + 1], line[e + 1]},
                                    static_cast<float>(s) / static_cast<float>(given[e]),
                                    0.0f});
        }
        samples.push_back(ofVertex(line[e + 1]));
      }
      return samples;
    }
    // Fewer than vertices: those nearest to equal distances
    double length = 0.0;
    for (const double m : metres) length += m;
    double passed = 0.0;
    std::size_t v = 0;
    for (int s = 1; s < steps; ++s) {
      const double target = length * s / steps;
      const std::size_t last = edges - static_cast<std::size_t>(steps - s);
      passed += metres[v];
      ++v;
      while (v < last && std::abs(passed + metres[v] - target) <= std::abs(passed - target)) {
        passed += metres[v];
        ++v;
      }
      samples.push_back(ofVertex(line[v]));
    }
    samples.push_back(ofVertex(line[edges]));
    return samples;
  }

  const MeshView& mesh_;
  const Outlines& outlines_;
  ObjectImage& image_;
  std::vector<std::vector<std::uint32_t>> ofArc_;
  std::vector<std::uint32_t> vertexSample_;
};

Vec3 placeOf(const MeshView& mesh, const TrianglePlace& place) {
  const std::uint32_t* v = &mesh.indices[3 * std::size_t{place.triangle}];
  const Vec3 p0 = mesh.positions[v[0]];
  return p0 + place.b1 * (mesh.positions[v[1]] - p0) + place.b2 * (mesh.positions[v[2]] - p0);
}

/// The place on the surface next to a point, walked to from `place` across edges.
TrianglePlace walkTo(const MeshView& mesh, const Topology& topology, TrianglePlace place,
                     const Vec3& point) {
  const auto normalOf = [&](std::size_t t) {
    return normalizedOr(areaNormal(mesh, t), Vec3(0.0f));
  };
  const Vec3 normal = normalOf(place.triangle);
  for (int step = 0; step < kMostSteps; ++step) {
    const std::size_t first = 3 * std::size_t{place.triangle};
    const Vec3 corner = mesh.positions[mesh.indices[first]];
    const Vec3 e1 = mesh.positions[mesh.indices[first + 1]] - corner;
    const Vec3 e2 = mesh.positions[mesh.indices[first + 2]] - corner;
    const Vec3 across = glm::cross(e1, e2);
    const float square = glm::dot(across, across);
    const float b1 = glm::dot(glm::cross(point - corner, e2), across) / square;
    const float b2 = glm::dot(glm::cross(e1, point - corner), across) / square;
    if (!std::isfinite(b1 + b2)) break;
    place.b1 = std::clamp(b1, 0.0f, 1.0f);
    place.b2 = std::clamp(b2, 0.0f, 1.0f - place.b1);
    const std::array<float, 3> weights = {1.0f - b1 - b2, b1, b2};
    const auto least = std::ranges::min_element(weights);
    if (*least >= 0.0f) break;
    const std::int32_t other =
        topology.across[nextCorner(first + static_cast<std::size_t>(least - weights.begin()))];
    if (other == kNobody ||
        glm::dot(normalOf(static_cast<std::size_t>(other) / 3), normal) < kCrease)
      break;
    place.triangle = static_cast<std::uint32_t>(other) / 3;
  }
  return place;
}

/// Along a chart's border the quads are no longer where the chart was flattened to: their texels
/// show the surface where they are now.
void moveBorderTexels(const MeshView& mesh, const Topology& topology, const ChartImage& chart,
                      ObjectImage& image) {
  const std::size_t n = std::size_t{1} << chart.level;
  const std::size_t finer = std::size_t{1} << (chart.texelLevel - chart.level);
  const auto vertex = [&](std::size_t x, std::size_t y) {
    const Sample& sample = image.samples[image.grid[chart.firstGrid + y * (n + 1) + x]];
    const Vec3 p0 = mesh.positions[sample.vertex[0]];
    return p0 + sample.w1 * (mesh.positions[sample.vertex[1]] - p0) +
           sample.w2 * (mesh.positions[sample.vertex[2]] - p0);
  };
  for (std::size_t y = 0; y < n * finer; ++y) {
    for (std::size_t x = 0; x < n * finer; ++x) {
      const std::size_t column = x / finer;
      const std::size_t row = y / finer;
      if (column > 0 && column + 1 < n && row > 0 && row + 1 < n) continue;
      float u = (static_cast<float>(x % finer) + 0.5f) / static_cast<float>(finer);
      float v = (static_cast<float>(y % finer) + 0.5f) / static_cast<float>(finer);
      const bool upper = u + v > 1.0f;
      const Vec3 corner = upper ? vertex(column + 1, row + 1) : vertex(column, row);
      const Vec3 right = vertex(upper ? column : column + 1, upper ? row + 1 : row) - corner;
      const Vec3 up = vertex(upper ? column + 1 : column, upper ? row : row + 1) - corner;
      if (upper) {
        u = 1.0f - u;
        v = 1.0f - v;
      }
      TrianglePlace& place = image.texels[chart.firstTexel + y * n * finer + x];
      const Vec3 point = corner + u * right + v * up;
      const TrianglePlace walked = walkTo(mesh, topology, place, point);
      if (glm::distance(placeOf(mesh, walked), point) <
          kNearer * glm::distance(placeOf(mesh, place), point))
        place = walked;
    }
  }
}

/// Writes a chart's grid: its inside, and its border by what it shares.
void addChart(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
              std::size_t index, const Prepared& made, const Borders& borders, ObjectImage& image) {
  ChartImage chart;
  chart.level = made.level;
  chart.texelLevel = made.texelLevel;
  chart.plain = made.plain;
  chart.firstGrid = static_cast<std::uint32_t>(image.grid.size());
  chart.firstTexel = static_cast<std::uint32_t>(image.texels.size());
  const int n = 1 << made.level;
  const auto row = static_cast<std::size_t>(n) + 1;
  image.grid.resize(image.grid.size() + row * row);
  std::uint32_t* grid = &image.grid[chart.firstGrid];
  for (int j = 1; j < n; ++j) {
    for (int i = 1; i < n; ++i) {
      const TrianglePlace& place = made.inner[static_cast<std::size_t>((j - 1) * (n - 1) + i - 1)];
      grid[static_cast<std::size_t>(j) * row + static_cast<std::size_t>(i)] =
          static_cast<std::uint32_t>(image.samples.size());
      const std::uint32_t* v = &mesh.indices[3 * std::size_t{place.triangle}];
      image.samples.push_back({{v[0], v[1], v[2]}, place.b1, place.b2});
    }
  }
  std::vector<int> ofUse(outlines.charts[index].border.size(), 0);
  for (const BorderPiece& piece : made.flat->pieces()) ofUse[piece.use] += piece.steps;
  int around = 0;
  for (const BorderPiece& piece : made.flat->pieces()) {
    for (int s = 0; s < piece.steps; ++s, ++around) {
      const int side = around / n;
      const int at = around % n;
      const int x = side == 0 ? at : side == 1 ? n : side == 2 ? n - at : 0;
      const int y = side == 0 ? 0 : side == 1 ? at : side == 2 ? n : n - at;
      grid[static_cast<std::size_t>(y) * row + static_cast<std::size_t>(x)] = borders.at(
          outlines.charts[index].border[piece.use], piece.firstStep + s, ofUse[piece.use]);
    }
  }
  image.texels.insert(image.texels.end(), made.texels.begin(), made.texels.end());
  image.charts.push_back(chart);
  if (!chart.plain) moveBorderTexels(mesh, topology, chart, image);
}

/// Four places where arcs of a chart's border meet, with as many arcs between them as can be alike,
/// and the shortest side as long as can be. None of a border with fewer arcs.
std::vector<std::uint32_t> junctions(const MeshView& mesh, const Outlines& outlines,
                                     const Chart& chart) {
  const std::size_t count = chart.border.size();
  if (count < 4) return {};
  std::vector<double> starts{0.0};
  for (std::size_t i = 0; i < 2 * count; ++i) {
    const std::vector<std::uint32_t>& line = outlines.arcs[chart.border[i % count].arc].vertices;
    double metres = 0.0;
    for (std::size_t v = 1; v < line.size(); ++v)
      metres +=
          static_cast<double>(glm::distance(mesh.positions[line[v - 1]], mesh.positions[line[v]]));
    starts.push_back(starts.back() + metres);
  }
  double longest = -1.0;
  std::array<std::size_t, 4> best{};
  for (std::size_t first = 0; first < count; ++first) {
    std::array<std::size_t, 5> at{};
    double shortest = starts.back();
    for (std::size_t k = 0; k < 5; ++k) at[k] = first + k * count / 4;
    for (std::size_t k = 0; k < 4; ++k)
      shortest = std::min(shortest, starts[at[k + 1]] - starts[at[k]]);
    if (shortest <= longest) continue;
    longest = shortest;
    std::copy_n(at.begin(), 4, best.begin());
  }
  std::vector<std::uint32_t> vertices;
  for (const std::size_t i : best) {
    const ArcUse& use = chart.border[i % count];
    const std::vector<std::uint32_t>& line = outlines.arcs[use.arc].vertices;
    vertices.push_back(use.forward ? line.front() : line.back());
  }
  return vertices;
}

/// Where the corners of the squares of charts from `first` on lie. Arcs end there: else the two
/// charts of an arc would spread its vertices differently. `levelOfChart`: of as many quads as a
/// chart is to have.
template <class LevelOfChart>
void findCorners(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
                 const LevelOfChart& levelOfChart, std::size_t first, std::vector<Prepared>& made) {
  parallelFor(made.size() - first, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = first + begin; c < first + end; ++c) {
      const Chart& chart = outlines.charts[c];
      if (!chart.simple) continue;
      FlatMesh flat(mesh, topology, outlines, c);
      flat.placeCorners();
      made[c].corners = flat.cornerVertices();
      // Where there are too few quads for the best corners and arcs of their own
      if (chart.triangles.size() <= kPlain || flat.giveSteps(levelOfChart(chart), 1)) continue;
      std::vector<std::uint32_t> others = junctions(mesh, outlines, chart);
      if (!others.empty()) made[c].corners = std::move(others);
    }
  });
}

/// On which side of the plane through a chart's middle, across its longest extent, a triangle lies.
class Halves {
 public:
  Halves(const MeshView& mesh, const Chart& chart) : mesh_(mesh) {
    Box3 box;
    for (const std::uint32_t t : chart.triangles) box.extend(middleOf(mesh_, t));
    middle_ = box.centre();
    // The direction to the farthest one, then that between the two ends
    const Vec3 end = farthest(chart, middle_);
    axis_ = farthest(chart, end) - end;
    middle_ = end + 0.5f * axis_;
  }
  bool second(std::uint32_t t) const {
    return glm::dot(middleOf(mesh_, t) - middle_, axis_) > 0.0f;
  }

 private:
  Vec3 farthest(const Chart& chart, const Vec3& from) const {
    Vec3 best = from;
    for (const std::uint32_t t : chart.triangles) {
      const Vec3 middle = middleOf(mesh_, t);
      if (glm::distance(middle, from) > glm::distance(best, from)) best = middle;
    }
    return best;
  }

  const MeshView& mesh_;
  Vec3 middle_{0.0f};
  Vec3 axis_{0.0f};
};

/// Keeps charts that are not to be cut, under the numbers from 0 on, and grows others anew within
/// the groups of their triangles. Returns the number of charts then.
template <class IsCut>
std::int32_t regrow(const MeshView& mesh, const Topology& topology, std::int32_t charts,
                    const IsCut& isCut, const std::vector<std::uint32_t>& groupOf,
                    std::vector<std::int32_t>& chartOf) {
  std::vector<std::int32_t> number(static_cast<std::size_t>(charts), kNobody);
  std::int32_t kept = 0;
  for (std::size_t c = 0; c < number.size(); ++c)
    if (!isCut(c)) number[c] = kept++;
  for (std::int32_t& chart : chartOf)
    if (chart != kNobody) chart = number[static_cast<std::size_t>(chart)];
  return growCharts(mesh, topology, groupOf, kept, chartOf);
}

/// Cuts charts that could not be flattened, or only with much stretch, in two; small ones into
/// their triangles. Returns the number of charts then.
std::int32_t cutBad(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
                    const std::vector<Prepared>& made, std::vector<std::int32_t>& chartOf) {
  std::vector<std::uint32_t> groupOf(chartOf.size(), 0);
  std::uint32_t groups = 0;
  for (std::size_t c = 0; c < made.size(); ++c) {
    const std::vector<std::uint32_t>& triangles = outlines.charts[c].triangles;
    if (!made[c].bad) continue;
    const Halves halves(mesh, outlines.charts[c]);
    std::size_t inSecond = 0;
    for (const std::uint32_t t : triangles) inSecond += halves.second(t) ? 1 : 0;
    const bool single =
        triangles.size() <= kSmallChart || inSecond == 0 || inSecond == triangles.size();
    for (const std::uint32_t t : triangles)
      groupOf[t] = single ? groups++ : groups + (halves.second(t) ? 1 : 0);
    if (!single) groups += 2;
  }
  return regrow(
      mesh, topology, static_cast<std::int32_t>(made.size()),
      [&](std::size_t c) { return made[c].bad; }, groupOf, chartOf);
}

void measure(const std::vector<Prepared>& made, ObjectImage& image) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Prepared& chart : made) {
    if (chart.plain) continue;
    sum += chart.stretch;
    ++count;
    image.mostStretch = std::max(image.mostStretch, chart.stretch);
  }
  if (count > 0) image.meanStretch = sum / static_cast<double>(count);
}

/// Charts' shares of an object's quads and texels.
class Shares {
 public:
  Shares(const MeshView& mesh, const Topology& topology, const ImageSize& size)
      : mesh_(mesh), size_(size) {
    for (std::uint32_t t = 0; t < mesh.triangles(); ++t) {
      if (topology.degenerate[t]) continue;
      area_ += areaOf(mesh, t);
      ++triangles_;
    }
  }
  ImageSize of(const Chart& chart) const {
    double part = 0.0;
    for (const std::uint32_t t : chart.triangles) part += areaOf(mesh_, t);
    const double ofTriangles =
        static_cast<double>(chart.triangles.size()) / static_cast<double>(triangles_);
    const double ofArea = area_ > 0.0 ? part / area_ : ofTriangles;
    return {size_.quads * (0.5 * ofArea + 0.5 * ofTriangles), size_.texels * ofArea, size_.most};
  }

 private:
  const MeshView& mesh_;
  const ImageSize size_;
  double area_ = 0.0;
  std::size_t triangles_ = 0;
};

/// Flattens all charts, and cuts those which are bad until none is.
std::vector<Prepared> flattenAll(const MeshView& mesh, const Topology& topology,
                                 const ImageSize& size, std::int32_t count,
                                 std::vector<std::int32_t>& chartOf, Outlines& outlines,
                                 std::uint64_t& notFlattened) {
  const Shares shares(mesh, topology, size);
  std::vector<Prepared> made;
  // Which charts are good is found out first; those that are cut leave the numbers below `judged`
  // to them. Then all are resampled, whose borders now are what they will be.
  for (bool whole = false;;) {
    const std::size_t judged = made.size();
    made.resize(static_cast<std::size_t>(count));
    findCorners(
        mesh, topology, findOutlines(topology, chartOf, count),
        [&](const Chart& chart) { return levelOf(shares.of(chart).quads, levelsIn(size.most)); },
        judged, made);
    std::vector<std::uint32_t> ends;
    for (const Prepared& chart : made)
      ends.insert(ends.end(), chart.corners.begin(), chart.corners.end());
    outlines = findOutlines(topology, chartOf, count, ends);
    parallelFor(made.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        const Chart& chart = outlines.charts[c];
        const bool known = c < judged && made[c].outline == fingerprintOf(outlines, chart);
        if (c >= judged || (whole && !known))
          flatten(mesh, topology, outlines, c, shares.of(chart), made[c]);
        if (whole && !made[c].failed) resample(chart, made[c]);
      }
    });
    std::size_t bad = 0;
    for (std::size_t c = 0; c < made.size(); ++c) {
      const bool stretched =
          made[c].stretch > kMostStretch && outlines.charts[c].triangles.size() > kSmallChart;
      made[c].bad = made[c].failed || stretched;
      notFlattened += made[c].failed ? 1 : 0;
      bad += made[c].bad ? 1 : 0;
    }
    if (whole && bad == 0) return made;
    if (bad > 0) count = cutBad(mesh, topology, outlines, made, chartOf);
    std::erase_if(made, [](const Prepared& chart) { return chart.bad; });
    whole = bad == 0;
  }
}

}  // namespace

ObjectImage makeObjectImage(const MeshView& mesh, const ImageSize& size) {
  ObjectImage image;
  const Topology topology = findTopology(mesh);
  const auto degenerate = std::ranges::count(topology.degenerate, true);
  image.degenerateTriangles = static_cast<std::uint64_t>(degenerate);
  std::vector<std::int32_t> chartOf;
  chartOf.assign(mesh.triangles(), kNobody);
  std::int32_t count =
      growCharts(mesh, topology, std::vector<std::uint32_t>(mesh.triangles(), 0), 0, chartOf);
  std::vector<std::size_t> triangles(static_cast<std::size_t>(count), 0);
  for (const std::int32_t chart : chartOf)
    if (chart != kNobody) ++triangles[static_cast<std::size_t>(chart)];
  if (std::ranges::any_of(triangles, [](std::size_t n) { return n > kMostTriangles; })) {
    const std::size_t cells = std::max(kLeastCells, mesh.triangles() / kCellTriangles);
    chartOf.assign(mesh.triangles(), kNobody);
    count = growCharts(mesh, topology, findCells(mesh, topology, cells), 0, chartOf);
  }
  Outlines outlines;
  const std::vector<Prepared> made =
      flattenAll(mesh, topology, size, count, chartOf, outlines, image.notFlattened);
  for (std::size_t c = 0; c < made.size(); ++c)
    if (made[c].plain) image.plainTriangles += outlines.charts[c].triangles.size();
  const Borders borders(mesh, outlines, made, image);
  for (std::size_t c = 0; c < made.size(); ++c)
    addChart(mesh, topology, outlines, c, made[c], borders, image);
  measure(made, image);
  return image;
}

}  // namespace catoptric::methods::glossy_lod
