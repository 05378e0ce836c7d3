#include "methods/glossy_lod/images/flat_mesh.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

namespace catoptric::methods::glossy_lod {
namespace {

/// Angle by which the border turns where a corner of the square is best, radians. Ours.
constexpr double kCornerTurn = 0.5;
/// Part of the border's length between two corners at the least. Ours.
constexpr double kCornerSpacing = 1.0 / 12.0;
/// Least weight of an edge, and greatest, relative to its length: slivers must not spoil the
/// system.
constexpr double kLeastTangent = 1e-4;
constexpr double kMostTangent = 1e4;
/// How far outside a triangle of the square a point still counts as on it. Ours: rounding.
constexpr double kOutside = 1e-7;

/// Metres from a border's start to that of each edge, and of all.
std::vector<double> startsOf(const std::vector<BorderEdge>& border) {
  std::vector<double> starts{0.0};
  for (const BorderEdge& edge : border) starts.push_back(starts.back() + edge.metres);
  return starts;
}

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace

std::vector<int> shareSteps(int steps, const std::vector<double>& lengths,
                            const std::vector<int>& least) {
  std::vector<int> given = least;
  int left = steps - std::accumulate(least.begin(), least.end(), 0);
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  if (left <= 0 || !(total > 0.0)) {
    if (left > 0) given.front() += left;
    return given;
  }
  // Those that have least of what their length asks for come first
  std::vector<double> ideal(lengths.size());
  double missing = 0.0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    ideal[i] = steps * lengths[i] / total;
    missing += std::max(0.0, ideal[i] - given[i]);
  }
  std::vector<std::pair<double, std::size_t>> rests;
  const int all = left;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double want = missing > 0.0 ? all * std::max(0.0, ideal[i] - given[i]) / missing : 0.0;
    const int whole = std::min(left, static_cast<int>(want));
    given[i] += whole;
    left -= whole;
    rests.push_back({whole - want, i});
  }
  std::sort(rests.begin(), rests.end());
  for (std::size_t k = 0; left > 0; ++k, --left) ++given[rests[k % rests.size()].second];
  return given;
}

FlatMesh::FlatMesh(const MeshView& mesh, const Topology& topology, const Outlines& outlines,
                   std::size_t chart) {
  const Chart& source = outlines.charts[chart];
  std::unordered_map<std::uint32_t, int> local;
  for (const std::uint32_t t : source.triangles) {
    Triangle triangle;
    triangle.source = t;
    triangle.at = {glm::dvec2(0.0, 0.0), glm::dvec2(1.0, 0.0), glm::dvec2(0.0, 1.0)};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = topology.vertex[3 * std::size_t{t} + i];
      const auto [known, isNew] = local.try_emplace(v, static_cast<int>(positions_.size()));
      if (isNew) {
        positions_.emplace_back(mesh.positions[v]);
        welded_.push_back(v);
      }
      triangle.v[i] = known->second;
    }
    triangles_.push_back(triangle);
  }
  for (std::size_t use = 0; use < source.border.size(); ++use) {
    const Arc& arc = outlines.arcs[source.border[use].arc];
    const std::size_t edges = arc.vertices.size() - 1;
    for (std::size_t e = 0; e < edges; ++e) {
      const bool forward = source.border[use].forward;
      const std::uint32_t from = arc.vertices[forward ? e : edges - e];
      const std::uint32_t to = arc.vertices[forward ? e + 1 : edges - e - 1];
      border_.push_back(
          {local.at(from), use,
           glm::distance(glm::dvec3(mesh.positions[from]), glm::dvec3(mesh.positions[to]))});
    }
  }
}

int FlatMesh::addVertex(const glm::dvec3& position) {
  positions_.push_back(position);
  return static_cast<int>(positions_.size()) - 1;
}

bool FlatMesh::splitTriangle(std::size_t t, int a, int b, double share, int middle) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const int from = triangles_[t].v[i];
    const int to = triangles_[t].v[j];
    const bool ahead = from == a && to == b;
    if (!ahead && !(from == b && to == a)) continue;
    const double s = ahead ? share : 1.0 - share;
    const glm::dvec2 at = glm::mix(triangles_[t].at[i], triangles_[t].at[j], s);
    Triangle second = triangles_[t];
    triangles_[t].v[j] = middle;
    triangles_[t].at[j] = at;
    second.v[i] = middle;
    second.at[i] = at;
    triangles_.push_back(second);
    return true;
  }
  return false;
}

void FlatMesh::splitEdge(int a, int b, double share, int middle) {
  const std::size_t count = triangles_.size();
  for (std::size_t t = 0; t < count; ++t) splitTriangle(t, a, b, share, middle);
}

void FlatMesh::cutAt(double metres) {
  std::size_t e = 0;
  while (e + 1 < border_.size() && metres >= border_[e].metres) metres -= border_[e++].metres;
  const BorderEdge edge = border_[e];
  const double share = std::clamp(metres / std::max(edge.metres, 1e-300), 0.0, 1.0);
  const std::size_t next = (e + 1) % border_.size();
  // A vertex nearby will do
  constexpr double kNear = 0.25;
  const auto isCorner = [&](std::size_t at) {
    return std::find(corners_.begin(), corners_.end(), at) != corners_.end();
  };
  std::size_t corner = e;
  if (share < kNear && !isCorner(e)) {
    corner = e;
  } else if (share > 1.0 - kNear && !isCorner(next)) {
    corner = next;
  } else {
    const double cut = std::clamp(share, kNear, 1.0 - kNear);
    const int to = border_[next].from;
    const int middle = addVertex(glm::mix(positions_[edge.from], positions_[to], cut));
    splitEdge(edge.from, to, cut, middle);
    border_[e].metres = edge.metres * cut;
    border_.insert(border_.begin() + static_cast<std::ptrdiff_t>(e) + 1,
                   {middle, edge.use, edge.metres * (1.0 - cut)});
    corner = e + 1;
    for (std::size_t& c : corners_) c += c >= corner ? 1 : 0;
  }
  corners_.push_back(corner);
  std::sort(corners_.begin(), corners_.end());
}

void FlatMesh::placeCorners() {
  std::vector<double> start = startsOf(border_);
  const double length = start.back();
  if (border_.size() == 4) {
    // Of two triangles the square's diagonal is the edge between them
    int uses = 0;
    for (const Triangle& t : triangles_)
      uses += std::count(t.v.begin(), t.v.end(), border_[0].from) > 0 ? 1 : 0;
    if (triangles_.size() == 2 && uses == 2) {
      corners_ = {1, 2, 3, 0};
    } else {
      corners_ = {0, 1, 2, 3};
    }
    makePieces();
    return;
  }
  if (triangles_.size() == 1) {
    corners_ = {0, 1, 2};
    const auto longest = std::max_element(
        border_.begin(), border_.end(),
        [](const BorderEdge& a, const BorderEdge& b) { return a.metres < b.metres; });
    cutAt(start[static_cast<std::size_t>(longest - border_.begin())] + 0.5 * longest->metres);
    start = startsOf(border_);
  }
  // Angles at all vertices of the border, by one pass over the triangles
  std::unordered_map<int, std::size_t> edgeFrom;
  for (std::size_t e = 0; e < border_.size(); ++e) edgeFrom[border_[e].from] = e;
  std::vector<double> turn(border_.size(), static_cast<double>(kPi));
  for (const Triangle& t : triangles_) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = edgeFrom.find(t.v[i]);
      if (at == edgeFrom.end()) continue;
      const glm::dvec3 a = positions_[t.v[(i + 1) % 3]] - positions_[t.v[i]];
      const glm::dvec3 b = positions_[t.v[(i + 2) % 3]] - positions_[t.v[i]];
      turn[at->second] -= std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }
  }
  std::vector<std::size_t> order(border_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return turn[a] > turn[b]; });
  for (const std::size_t e : order) {
    if (corners_.size() >= 3 && triangles_.size() == 2) break;
    if (corners_.size() == 4 || turn[e] < kCornerTurn) break;
    const bool apart = std::all_of(corners_.begin(), corners_.end(), [&](std::size_t c) {
      const double gap = std::abs(start[c] - start[e]);
      return std::min(gap, length - gap) >= kCornerSpacing * length;
    });
    if (apart) corners_.push_back(e);
  }
  std::sort(corners_.begin(), corners_.end());
  if (corners_.empty()) corners_.push_back(0);
  while (corners_.size() < 4) {
    double widest = -1.0;
    double middle = 0.0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const double from = start[corners_[i]];
      const double to =
          i + 1 < corners_.size() ? start[corners_[i + 1]] : start[corners_[0]] + length;
      if (to - from > widest) {
        widest = to - from;
        middle = 0.5 * (from + to);
      }
    }
    cutAt(middle >= length ? middle - length : middle);
    start = startsOf(border_);
  }
  // The corner on an edge of a single triangle is v00: half of the square has no area
  const int added = static_cast<int>(positions_.size()) - 1;
  if (border_.size() == 4 && triangles_.size() == 2) {
    const auto at = std::find_if(corners_.begin(), corners_.end(),
                                 [&](std::size_t c) { return border_[c].from == added; });
    std::rotate(corners_.begin(), at, corners_.end());
  }
  makePieces();
}

TrianglePlace FlatMesh::onHalf(bool lower, double b1, double b2) const {
  const auto corner = [&](std::size_t i) { return border_[corners_[i]].from; };
  const std::array<int, 3> v = lower ? std::array{corner(0), corner(1), corner(3)}
                                     : std::array{corner(2), corner(3), corner(1)};
  const std::array<double, 3> weight = {1.0 - b1 - b2, b1, b2};
  const auto whose = std::find_if(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
    return std::find(t.v.begin(), t.v.end(), v[0]) != t.v.end();
  });
  glm::dvec2 at(0.0);
  for (std::size_t k = 0; k < 3; ++k) {
    for (const Triangle& t : triangles_) {
      const auto found = std::find(t.v.begin(), t.v.end(), v[k]);
      if (t.source != whose->source || found == t.v.end()) continue;
      at += weight[k] * t.at[static_cast<std::size_t>(found - t.v.begin())];
      break;
    }
  }
  return {whose->source, static_cast<float>(at.x), static_cast<float>(at.y)};
}

void FlatMesh::placeCorners(const std::array<std::uint32_t, 4>& vertices) {
  for (std::size_t e = 0; e < border_.size(); ++e) {
    const std::uint32_t v = welded_[static_cast<std::size_t>(border_[e].from)];
    if (std::find(vertices.begin(), vertices.end(), v) != vertices.end()) corners_.push_back(e);
  }
  makePieces();
}

std::vector<std::uint32_t> FlatMesh::cornerVertices() const {
  std::vector<std::uint32_t> vertices;
  for (const std::size_t c : corners_) {
    const auto v = static_cast<std::size_t>(border_[c].from);
    if (v < welded_.size()) vertices.push_back(welded_[v]);
  }
  return vertices;
}

void FlatMesh::makePieces() {
  pieces_.clear();
  for (std::size_t side = 0; side < 4; ++side) {
    firstPiece_[side] = pieces_.size();
    const std::size_t end = corners_[(side + 1) % 4];
    for (std::size_t e = corners_[side]; e != end; e = (e + 1) % border_.size()) {
      const bool goesOn = pieces_.size() > firstPiece_[side] &&
                          pieces_.back().use == border_[e].use &&
                          e == pieces_.back().firstEdge + pieces_.back().edges;
      if (goesOn) {
        ++pieces_.back().edges;
      } else {
        pieces_.push_back({.use = border_[e].use, .firstEdge = e, .edges = 1});
      }
    }
  }
  firstPiece_[4] = pieces_.size();
}

bool FlatMesh::giveSteps(int level, int wanted) {
  const int n = 1 << level;
  for (std::size_t side = 0; side < 4; ++side) {
    std::vector<double> lengths;
    std::vector<int> least;
    int sum = 0;
    for (std::size_t p = firstPiece_[side]; p < firstPiece_[side + 1]; ++p) {
      double metres = 0.0;
      for (std::size_t e = 0; e < pieces_[p].edges; ++e)
        metres += border_[pieces_[p].firstEdge + e].metres;
      lengths.push_back(metres);
      least.push_back(std::clamp(static_cast<int>(pieces_[p].edges), 1, wanted));
      sum += least.back();
    }
    if (sum > n) return false;
    const std::vector<int> steps = shareSteps(n, lengths, least);
    for (std::size_t i = 0; i < steps.size(); ++i) pieces_[firstPiece_[side] + i].steps = steps[i];
  }
  // Steps along an arc are counted from its start
  std::vector<std::size_t> order(pieces_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return pieces_[a].firstEdge < pieces_[b].firstEdge;
  });
  std::map<std::size_t, int> sofar;
  for (const std::size_t p : order) {
    pieces_[p].firstStep = sofar[pieces_[p].use];
    sofar[pieces_[p].use] += pieces_[p].steps;
  }
  level_ = level;
  return true;
}

void FlatMesh::placeBorder() {
  const double n = 1 << level_;
  constexpr std::array<glm::dvec2, 4> kFrom = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  uv_.assign(positions_.size(), glm::dvec2(0.5));
  for (std::size_t side = 0; side < 4; ++side) {
    double at = 0.0;
    for (std::size_t p = firstPiece_[side]; p < firstPiece_[side + 1]; ++p) {
      const BorderPiece& piece = pieces_[p];
      double metres = 0.0;
      for (std::size_t e = 0; e < piece.edges; ++e) metres += border_[piece.firstEdge + e].metres;
      double passed = 0.0;
      for (std::size_t e = 0; e < piece.edges; ++e) {
        const BorderEdge& edge = border_[piece.firstEdge + e];
        const double s = (at + piece.steps * passed / std::max(metres, 1e-300)) / n;
        uv_[static_cast<std::size_t>(edge.from)] = glm::mix(kFrom[side], kFrom[(side + 1) % 4], s);
        passed += edge.metres;
      }
      at += piece.steps;
    }
  }
}

// What lies beyond an edge between two vertices of one side would have no area in the square.
void FlatMesh::splitChords() {
  std::vector<unsigned> sides(positions_.size(), 0);  // bit s: the vertex lies on side s
  for (std::size_t side = 0; side < 4; ++side) {
    for (std::size_t e = corners_[side];; e = (e + 1) % border_.size()) {
      sides[static_cast<std::size_t>(border_[e].from)] |= 1u << side;
      if (e == corners_[(side + 1) % 4]) break;
    }
  }
  std::map<std::pair<int, int>, std::vector<std::size_t>> chords;  // their triangles
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = triangles_[t].v[i];
      const int b = triangles_[t].v[(i + 1) % 3];
      if ((sides[static_cast<std::size_t>(a)] & sides[static_cast<std::size_t>(b)]) != 0)
        chords[{std::min(a, b), std::max(a, b)}].push_back(t);
    }
  // What a triangle has become: those that have been added for it
  std::unordered_map<std::size_t, std::vector<std::size_t>> parts;
  for (const auto& [edge, of] : chords) {
    if (of.size() < 2) continue;
    const int middle = addVertex(0.5 * (positions_[edge.first] + positions_[edge.second]));
    for (const std::size_t t : of) {
      std::vector<std::size_t>& added = parts[t];
      bool split = splitTriangle(t, edge.first, edge.second, 0.5, middle);
      for (std::size_t k = 0; k < added.size() && !split; ++k)
        split = splitTriangle(added[k], edge.first, edge.second, 0.5, middle);
      if (split) added.push_back(triangles_.size() - 1);
    }
  }
}

bool FlatMesh::solve() {
  std::vector<int> unknown(positions_.size(), 0);
  for (const BorderEdge& edge : border_) unknown[static_cast<std::size_t>(edge.from)] = -1;
  int count = 0;
  for (int& u : unknown)
    if (u == 0) u = count++;
  if (count == 0) return true;

  using Matrix = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count, 2);
  const auto add = [&](int row, int other, double weight) {
    entries.emplace_back(row, row, weight);
    const auto v = static_cast<std::size_t>(other);
    if (unknown[v] >= 0) {
      entries.emplace_back(row, unknown[v], -weight);
    } else {
      right(row, 0) += weight * uv_[v].x;
      right(row, 1) += weight * uv_[v].y;
    }
  };
  for (const Triangle& t : triangles_) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int row = unknown[static_cast<std::size_t>(t.v[i])];
      if (row < 0) continue;
      const int b = t.v[(i + 1) % 3];
      const int c = t.v[(i + 2) % 3];
      const glm::dvec3 toB = positions_[b] - positions_[t.v[i]];
      const glm::dvec3 toC = positions_[c] - positions_[t.v[i]];
      const double lengths = glm::length(toB) * glm::length(toC);
      // Tangent of half the angle [Floater2003] (2.1)
      const double tangent = std::clamp(
          glm::length(glm::cross(toB, toC)) / std::max(lengths + glm::dot(toB, toC), 1e-300),
          kLeastTangent, kMostTangent);
      add(row, b, tangent / std::max(glm::length(toB), 1e-150));
      add(row, c, tangent / std::max(glm::length(toC), 1e-150));
    }
  }
  Matrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd scale = matrix.diagonal().cwiseInverse();
  const Matrix normalized = scale.asDiagonal() * matrix;
  Eigen::SparseLU<Matrix> solver(normalized);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::MatrixX2d found = solver.solve(scale.asDiagonal() * right);
  for (std::size_t v = 0; v < positions_.size(); ++v)
    if (unknown[v] >= 0) uv_[v] = {found(unknown[v], 0), found(unknown[v], 1)};
  return true;
}

bool FlatMesh::flatten() {
  splitChords();
  placeBorder();
  if (!solve()) return false;
  return std::all_of(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
    const double area = cross(uv_[t.v[1]] - uv_[t.v[0]], uv_[t.v[2]] - uv_[t.v[0]]);
    return std::isfinite(area) && area > -1e-12;
  });
}

std::vector<TrianglePlace> FlatMesh::placesAt(int n, double shift, int first, int count) const {
  const auto size = static_cast<std::size_t>(std::max(0, count));
  std::vector<TrianglePlace> places(size * size);
  std::vector<double> inside(places.size(), -1.0);
  for (const Triangle& t : triangles_) {
    const glm::dvec2 a = uv_[t.v[0]];
    const glm::dvec2 e1 = uv_[t.v[1]] - a;
    const glm::dvec2 e2 = uv_[t.v[2]] - a;
    const double area = cross(e1, e2);
    if (!(area > 1e-18)) continue;
    const glm::dvec2 least = glm::min(a, glm::min(uv_[t.v[1]], uv_[t.v[2]])) - kOutside;
    const glm::dvec2 most = glm::max(a, glm::max(uv_[t.v[1]], uv_[t.v[2]])) + kOutside;
    const auto from = [&](double x) {
      return std::max(0, static_cast<int>(std::ceil(x * n - shift)) - first);
    };
    const auto to = [&](double x) {
      return std::min(count - 1, static_cast<int>(std::floor(x * n - shift)) - first);
    };
    for (int j = from(least.y); j <= to(most.y); ++j) {
      for (int i = from(least.x); i <= to(most.x); ++i) {
        const glm::dvec2 p((first + i + shift) / n, (first + j + shift) / n);
        const double b1 = cross(p - a, e2) / area;
        const double b2 = cross(e1, p - a) / area;
        const double least3 = std::min(std::min(b1, b2), 1.0 - b1 - b2);
        const std::size_t at = static_cast<std::size_t>(j) * size + static_cast<std::size_t>(i);
        if (least3 <= inside[at]) continue;
        inside[at] = least3;
        const double c1 = std::clamp(b1, 0.0, 1.0);
        const double c2 = std::clamp(b2, 0.0, 1.0 - c1);
        const glm::dvec2 source = t.at[0] + c1 * (t.at[1] - t.at[0]) + c2 * (t.at[2] - t.at[0]);
        places[at] = {t.source, static_cast<float>(source.x), static_cast<float>(source.y)};
      }
    }
  }
  const bool covered =
      std::all_of(inside.begin(), inside.end(), [](double d) { return d >= -1e-5; });
  if (!covered) places.clear();
  return places;
}

double FlatMesh::stretch() const {
  double squares = 0.0;
  double product = 0.0;
  double area = 0.0;
  for (const Triangle& t : triangles_) {
    const glm::dvec2 e1 = uv_[t.v[1]] - uv_[t.v[0]];
    const glm::dvec2 e2 = uv_[t.v[2]] - uv_[t.v[0]];
    const double flat = cross(e1, e2);
    const glm::dvec3 p1 = positions_[t.v[1]] - positions_[t.v[0]];
    const glm::dvec3 p2 = positions_[t.v[2]] - positions_[t.v[0]];
    const double real = glm::length(glm::cross(p1, p2));
    if (!(flat > 1e-18)) continue;
    const glm::dvec3 u = (p1 * e2.y - p2 * e1.y) / flat;
    const glm::dvec3 v = (p2 * e1.x - p1 * e2.x) / flat;
    squares += flat * 0.5 * (glm::dot(u, u) + glm::dot(v, v));
    product += real;
    area += flat;
  }
  return area > 0.0 && product > 0.0 ? std::sqrt(squares / product) : 1.0;
}

}  // namespace catoptric::methods::glossy_lod
