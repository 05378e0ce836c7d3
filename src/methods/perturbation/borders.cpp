#include "methods/perturbation/borders.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/parallel.h"
#include "methods/perturbation/reflection_match.h"

namespace catoptric::methods::perturbation {
namespace {

/// Two reflections about a caustic are joined up to this distance, of the image's height (ours).
constexpr float kWidestFold = 1.0f / 12.0f;
/// Halvings of the edge on which a reflection ends (ours).
constexpr int kBorderSteps = 5;

template <class Border>
void sortOnce(std::vector<Border>& borders) {
  std::sort(borders.begin(), borders.end());
  borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
}

template <class Border>
std::size_t numberIn(const std::vector<Border>& borders, const Border& border) {
  return static_cast<std::size_t>(std::lower_bound(borders.begin(), borders.end(), border) -
                                  borders.begin());
}

}  // namespace

std::pair<VertexPlace, double> Borders::endOf(const Border& border, PathCounts& counts) const {
  const VertexPlace& from = table_.places[border.have];
  const VertexPlace& to = table_.places[border.lacking];
  Reflections known;
  known.count = 1;
  known.at[0] = from.reflections.at[border.number];
  double low = 0.0;
  double high = 1.0;
  for (int step = 0; step < kBorderSteps; ++step) {
    const double t = 0.5 * (low + high);
    Reflections found;
    reflector_.addReflectionsNear(glm::mix(from.position, to.position, t), known, found, counts);
    const bool goesOn = found.count > 0 && table_.near(found.at[0], known.at[0], kTornEdge);
    if (goesOn) known = found;
    (goesOn ? low : high) = t;
  }
  VertexPlace end;
  end.position = glm::mix(from.position, to.position, low);
  end.reflections = std::move(known);
  return {std::move(end), low};
}

void Borders::findEnds(std::span<const Triangle> triangles) {
  for (const Triangle& t : triangles) {
    forPieces(t, [&](std::span<const Corner> corners) {
      for (const Corner& c : corners) {
        if (c.isBorder) borders_.push_back(c.border);
      }
    });
  }
  sortOnce(borders_);
  for (const Border& border : borders_) between_.push_back(placesOf(border));
  sortOnce(between_);
  const std::size_t first = table_.places.size();
  table_.addPlaces(between_.size());
  shares_.resize(between_.size());
  std::mutex mutex;
  parallelFor(between_.size(), 64, [&](std::size_t begin, std::size_t end) {
    TriangleCounts own;
    for (std::size_t i = begin; i < end; ++i) {
      std::tie(table_.places[first + i], shares_[i]) = endOf(between_[i], own.paths);
      table_.project(first + i);
    }
    const std::lock_guard lock(mutex);
    counts_.add(own);
  });
  firstEnd_ = table_.vertexCount();
  for (const Border& border : borders_) {
    const std::size_t i = numberIn(between_, placesOf(border));
    table_.addVertex(static_cast<std::uint32_t>(first + i),
                     mixed(table_.attributesOf(border.have), table_.attributesOf(border.lacking),
                           static_cast<float>(shares_[i])));
  }
}

void Borders::put(std::span<const Triangle> triangles) {
  findEnds(triangles);
  output_.numberVertices();
  for (const Triangle& t : triangles) putTriangle(t);
}

std::uint32_t Borders::vertexOf(const Corner& c) const {
  return c.isBorder ? static_cast<std::uint32_t>(firstEnd_ + numberIn(borders_, c.border))
                    : c.border.have;
}

double Borders::shareOf(const Corner& c) const {
  return shares_[numberIn(between_, placesOf(c.border))];
}

void Borders::putTriangle(const Triangle& t) {
  std::vector<Piece> pieces;
  forPieces(t, [&](std::span<const Corner> corners) {
    for (std::size_t c = 2; c < corners.size(); ++c)
      output_.putCorners({vertex(corners[0]), vertex(corners[c - 1]), vertex(corners[c])});
    pieces.emplace_back(corners.begin(), corners.end());
  });
  // Two reflections that end in one place of an edge merge there: what is left between them is a
  // strip. At rims each ends for itself.
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    for (std::size_t q = p + 1; q < pieces.size(); ++q) joinFold(pieces[p], pieces[q]);
  }
}

bool Borders::merge(const Corner& x, const Corner& y) const {
  const auto xs = table_.projection(reflection(x).x);
  const auto ys = table_.projection(reflection(y).x);
  const double apart = std::abs(shareOf(x) - shareOf(y));
  if (!xs || !ys || apart > std::ldexp(1.0, -kBorderSteps) ||
      !(glm::distance(*xs, *ys) < kWidestFold * table_.projection.height()))
    return false;
  // They come nearer to each other ...
  const auto start = [&](const Corner& corner) {
    return table_.seen(table_.placeOf(corner.border.have), corner.border.number);
  };
  return glm::distance(*xs, *ys) <= glm::distance(start(x), start(y));
}

bool Borders::turnsLeft(const Piece& piece) const {
  float twice = 0.0f;
  for (std::size_t c = 0; c < piece.size(); ++c) {
    const Vec2 from = table_.seenAt(reflection(piece[c]));
    const Vec2 to = table_.seenAt(reflection(piece[(c + 1) % piece.size()]));
    twice += from.x * to.y - from.y * to.x;
  }
  return twice > 0.0f;
}

void Borders::joinFold(const Piece& p, const Piece& q) {
  const auto ends = [](const Piece& piece) {
    Piece border;
    for (const Corner& c : piece) {
      if (c.isBorder) border.push_back(c);
    }
    return border;
  };
  const Piece a = ends(p);
  const Piece b = ends(q);
  if (a.size() != 2 || b.size() != 2) return;
  const auto same = [](const Corner& x, const Corner& y) {
    return x.border.have == y.border.have && x.border.lacking == y.border.lacking;
  };
  if (!same(a[0], b[0]) || !same(a[1], b[1])) return;
  if (!merge(a[0], b[0]) || !merge(a[1], b[1])) return;
  // ... and are each other's mirror images
  if (turnsLeft(p) == turnsLeft(q)) return;
  output_.putCorners({vertex(a[0]), vertex(a[1]), vertex(b[1])});
  output_.putCorners({vertex(a[0]), vertex(b[1]), vertex(b[0])});
}

template <class Put>
void Borders::forPieces(const Triangle& t, const Put& putPiece) const {
  std::array<std::uint64_t, 3> done{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Reflections& mine = table_.placeAt(t[k]).reflections;
    for (std::size_t i = 0; i < mine.count; ++i) {
      if ((done[k] >> i & 1) != 0) continue;
      std::array<std::size_t, 3> number{};
      for (std::size_t c = 0; c < 3; ++c) {
        number[c] = c == k ? i : counterpart(mine, i, table_.placeAt(t[c]).reflections);
        if (number[c] == kMaxReflections) continue;
        // The nearest one need not be the same
        const float apart = glm::distance(table_.seen(table_.placeOf(t[k]), i),
                                          table_.seen(table_.placeOf(t[c]), number[c]));
        if (apart > std::max(kTornEdge, kStretch * table_.apparent(table_.placeAt(t[k]),
                                                                   table_.placeAt(t[c])))) {
          number[c] = kMaxReflections;
          continue;
        }
        if ((done[c] >> number[c] & 1) != 0) {
          number[c] = kMaxReflections;
        } else {
          done[c] |= std::uint64_t{1} << number[c];
        }
      }
      // Around the triangle, with the ends of its edges that leave the reflection
      std::array<Corner, 4> corners;
      std::size_t count = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t next = (c + 1) % 3;
        const auto at = [&](std::size_t x) { return static_cast<std::uint32_t>(number[x]); };
        const bool has = number[c] != kMaxReflections;
        const bool hasNext = number[next] != kMaxReflections;
        if (has) corners[count++] = {{t[c], at(c), 0}, false};
        if (has && !hasNext) corners[count++] = {{t[c], at(c), t[next]}, true};
        if (!has && hasNext) corners[count++] = {{t[next], at(next), t[c]}, true};
      }
      putPiece(std::span<const Corner>(corners.data(), count));
    }
  }
}

}  // namespace catoptric::methods::perturbation
