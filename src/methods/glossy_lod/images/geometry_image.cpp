#include "methods/glossy_lod/images/geometry_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>

#include "core/parallel.h"

namespace catoptric::methods::glossy_lod {
namespace {

/// A border with all of the mesh's edges may make a chart's grid finer by so many levels than its
/// share of the quads. Ours.
constexpr int kFinerForBorder = 1;
/// Else a run of edges gets so many steps at the least. Ours.
constexpr int kWantedSteps = 4;
/// More steps than any run of edges has.
constexpr int kAllSteps = 1 << kMostLevels;
/// Triangles of a chart that is traced as it is: those of a quad.
constexpr std::size_t kPlain = 2;

double areaOf(const MeshView& mesh, std::uint32_t t) {
  const glm::dvec3 a(mesh.positions[mesh.indices[3 * t]]);
  return 0.5 * glm::length(glm::cross(glm::dvec3(mesh.positions[mesh.indices[3 * t + 1]]) - a,
                                      glm::dvec3(mesh.positions[mesh.indices[3 * t + 2]]) - a));
}

/// FlatMesh::stretch() from which on a chart is cut in two. Ours: a rectangle of 1 x 12.
constexpr double kMostStretch = 2.5;
/// Charts of so few triangles are not cut in two but into these. Ours.
constexpr std::size_t kSmallChart = 4;

/// A chart on its way: flat, with as many quads as it gets.
struct Prepared {
  std::unique_ptr<FlatMesh> flat;
  bool failed = false;  ///< it cannot be flattened
  bool bad = false;     ///< it is to be cut
  bool plain = false;
  int level = 0;
  int texelLevel = 0;
  std::vector<Place> inner;  ///< of the grid's vertices inside, (2^level - 1)^2
  std::vector<Place> texels;
  double stretch = 1.0;
};

int levelOf(double quads, int most) {
  if (!(quads > 1.0)) return 0;
  return std::clamp(static_cast<int>(std::lround(0.5 * std::log2(quads))), 0, most);
}

/// Where the centres of a plain chart's texels lie, on the triangles that the traversal has.
std::vector<Place> plainTexels(const Chart& chart, const FlatMesh& flat, int texelLevel) {
  const int n = 1 << texelLevel;
  std::vector<Place> texels;
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

Prepared prepare(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
                 std::size_t index, const std::vector<std::uint32_t>& corners, double quads,
                 int most, bool whole) {
  const Chart& chart = outlines.charts[index];
  Prepared made;
  made.plain = chart.triangles.size() <= kPlain;
  if (!chart.simple) {
    made.failed = true;
    return made;
  }
  made.flat = std::make_unique<FlatMesh>(mesh, topology, outlines, index);
  FlatMesh& flat = *made.flat;
  if (corners.size() == 4 && !made.plain) {
    flat.placeCorners({corners[0], corners[1], corners[2], corners[3]});
  } else {
    flat.placeCorners();
  }
  const int level = made.plain ? 0 : levelOf(quads, most);
  made.failed = true;
  for (const int wanted : {made.plain ? 1 : kAllSteps, kWantedSteps, 1}) {
    const int finest = wanted == 1 ? most : std::min(most, level + kFinerForBorder);
    for (int finer = level; finer <= finest && made.failed; ++finer)
      made.failed = !flat.giveSteps(finer, wanted);
    if (!made.failed) break;
  }
  if (made.failed) return made;
  made.level = flat.level();
  made.texelLevel = made.plain ? levelOf(quads, most) : made.level;
  if (made.plain) {
    made.texels = plainTexels(chart, flat, made.texelLevel);
    return made;
  }
  const int n = 1 << made.level;
  made.failed = !flat.flatten();
  if (made.failed) return made;
  made.stretch = flat.stretch();
  if (!whole) return made;
  made.inner = flat.placesAt(n, 0.0, 1, n - 1);
  made.texels = flat.placesAt(n, 0.5, 0, n);
  made.failed = made.texels.empty() || (n > 1 && made.inner.empty());
  return made;
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

/// Writes a chart's grid: its inside, and its border by what it shares.
void addChart(const MeshView& mesh, const Outlines& outlines, std::size_t index,
              const Prepared& made, const Borders& borders, ObjectImage& image) {
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
      const Place& place = made.inner[static_cast<std::size_t>((j - 1) * (n - 1) + i - 1)];
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
}

/// Where the corners of each chart's square lie, at which arcs end: else the two charts of an arc
/// would spread its vertices differently.
std::vector<std::vector<std::uint32_t>> cornersOf(const MeshView& mesh, const Topology& topology,
                                                  const Outlines& outlines) {
  std::vector<std::vector<std::uint32_t>> corners(outlines.charts.size());
  parallelFor(corners.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      if (!outlines.charts[c].simple) continue;
      FlatMesh flat(mesh, topology, outlines, c);
      flat.placeCorners();
      corners[c] = flat.cornerVertices();
    }
  });
  return corners;
}

/// On which side of the plane through a chart's middle, across its longest extent, a triangle lies.
class Halves {
 public:
  Halves(const MeshView& mesh, const Chart& chart) : mesh_(mesh) {
    Box3 box;
    for (const std::uint32_t t : chart.triangles) box.extend(middleOf(t));
    middle_ = box.centre();
    // The direction to the farthest one, then that between the two ends
    const Vec3 end = farthest(chart, middle_);
    axis_ = farthest(chart, end) - end;
    middle_ = end + 0.5f * axis_;
  }
  bool second(std::uint32_t t) const { return glm::dot(middleOf(t) - middle_, axis_) > 0.0f; }

 private:
  Vec3 middleOf(std::uint32_t t) const {
    const std::uint32_t* v = &mesh_.indices[3 * std::size_t{t}];
    return (mesh_.positions[v[0]] + mesh_.positions[v[1]] + mesh_.positions[v[2]]) / 3.0f;
  }
  Vec3 farthest(const Chart& chart, const Vec3& from) const {
    Vec3 best = from;
    for (const std::uint32_t t : chart.triangles) {
      if (glm::distance(middleOf(t), from) > glm::distance(best, from)) best = middleOf(t);
    }
    return best;
  }

  const MeshView& mesh_;
  Vec3 middle_{0.0f};
  Vec3 axis_{0.0f};
};

/// Cuts charts that could not be flattened, or only with much stretch, in two; small ones into
/// their triangles. Returns the number of charts then.
std::int32_t cutBad(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
                    const std::vector<Prepared>& made, std::vector<std::int32_t>& chartOf) {
  std::vector<std::uint32_t> groupOf(chartOf.size(), 0);
  std::int32_t count = 0;
  std::uint32_t groups = 0;
  for (std::size_t c = 0; c < made.size(); ++c) {
    const std::vector<std::uint32_t>& triangles = outlines.charts[c].triangles;
    if (!made[c].bad) {
      for (const std::uint32_t t : triangles) chartOf[t] = count;
      ++count;
      continue;
    }
    const Halves halves(mesh, outlines.charts[c]);
    std::size_t inSecond = 0;
    for (const std::uint32_t t : triangles) inSecond += halves.second(t) ? 1 : 0;
    const bool single =
        triangles.size() <= kSmallChart || inSecond == 0 || inSecond == triangles.size();
    for (const std::uint32_t t : triangles) {
      chartOf[t] = kNobody;
      groupOf[t] = single ? groups++ : groups + (halves.second(t) ? 1 : 0);
    }
    if (!single) groups += 2;
  }
  return growCharts(mesh, topology, groupOf, count, chartOf);
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

}  // namespace

ObjectImage makeObjectImage(const MeshView& mesh, double quads, int size) {
  ObjectImage image;
  const Topology topology = findTopology(mesh);
  std::vector<std::int32_t> chartOf;
  chartOf.assign(mesh.triangles(), kNobody);
  std::int32_t count =
      growCharts(mesh, topology, std::vector<std::uint32_t>(mesh.triangles(), 0), 0, chartOf);
  double area = 0.0;
  std::size_t triangles = 0;
  for (std::uint32_t t = 0; t < mesh.triangles(); ++t) {
    if (topology.degenerate[t]) continue;
    area += areaOf(mesh, t);
    ++triangles;
  }
  image.degenerateTriangles = mesh.triangles() - triangles;
  const int most = std::bit_width(static_cast<unsigned>(size)) - 1;
  Outlines outlines;
  std::vector<Prepared> made;
  // Which charts are good is found out first; those that are cut leave the numbers below `judged`
  // to them. Then all are made, whose borders now are what they will be.
  std::size_t judged = 0;
  for (bool whole = false, done = false; !done;) {
    outlines = findOutlines(topology, chartOf, count);
    const std::vector<std::vector<std::uint32_t>> corners = cornersOf(mesh, topology, outlines);
    std::vector<std::uint32_t> ends;
    for (const auto& vertices : corners) ends.insert(ends.end(), vertices.begin(), vertices.end());
    outlines = findOutlines(topology, chartOf, count, ends);
    made.clear();
    made.resize(outlines.charts.size());
    parallelFor(made.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        if (!whole && c < judged) continue;
        double part = 0.0;
        for (const std::uint32_t t : outlines.charts[c].triangles) part += areaOf(mesh, t);
        const double ofTriangles = static_cast<double>(outlines.charts[c].triangles.size()) /
                                   static_cast<double>(triangles);
        const double share = 0.5 * (area > 0.0 ? part / area : ofTriangles) + 0.5 * ofTriangles;
        made[c] = prepare(mesh, topology, outlines, c, corners[c], quads * share, most, whole);
      }
    });
    std::size_t bad = 0;
    for (std::size_t c = 0; c < made.size(); ++c) {
      const bool stretched =
          made[c].stretch > kMostStretch && outlines.charts[c].triangles.size() > kSmallChart;
      made[c].bad = made[c].failed || stretched;
      image.notFlattened += made[c].failed ? 1 : 0;
      bad += made[c].bad ? 1 : 0;
    }
    if (bad > 0) count = cutBad(mesh, topology, outlines, made, chartOf);
    judged = made.size() - bad;
    done = whole && bad == 0;
    whole = bad == 0;
  }
  for (std::size_t c = 0; c < made.size(); ++c)
    if (made[c].plain) image.plainTriangles += outlines.charts[c].triangles.size();
  const Borders borders(mesh, outlines, made, image);
  for (std::size_t c = 0; c < made.size(); ++c)
    addChart(mesh, outlines, c, made[c], borders, image);
  measure(made, image);
  return image;
}

}  // namespace catoptric::methods::glossy_lod
