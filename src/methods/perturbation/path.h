// Paths p = x_0, x_1, ..., x_N, x_{N+1} = q over implicit surfaces: their expansion, what becomes
// of them when p moves, exact ones by Newton's method, and where q sees p.
#pragma once

#include <vector>

#include "methods/perturbation/bounce.h"

namespace catoptric::methods::perturbation {

/// A bounce of a path: x_i, its surface there, and the index of refraction on the side of x_{i-1}
/// (1 for reflections in air).
template <class S>
struct PathVertex {
  Vector<S> x;
  Jet3<S> g;
  S index{1};
};

/// x_i as functions of x_{i-1}, in the path's order.
template <class S>
struct PathExpansion {
  std::vector<Bounce<S>> bounces;
  std::vector<S> distances;  ///< |x_i - x_{i-1}|
  PathStatus status = PathStatus::Regular;
};

/// [Chen2000] PathJacHess (Fig. 4, 5), from q to p. `lastIndex`: of refraction, before q.
template <class S>
PathExpansion<S> expandPath(const Vector<S>& p, const std::vector<PathVertex<S>>& vertices,
                            const Vector<S>& q, const S& lastIndex = S(1)) {
  PathExpansion<S> path;
  const std::size_t count = vertices.size();
  path.bounces.resize(count);
  path.distances.resize(count);
  if (!(length(vertices.back().x - q) > 0)) {
    path.status = PathStatus::Degenerate;
    return path;
  }
  Eikonal<S> rest = straightTo(q, vertices.back().x, lastIndex);
  for (std::size_t i = count; i-- > 0;) {
    const PathVertex<S>& vertex = vertices[i];
    const Vector<S>& previous = i > 0 ? vertices[i - 1].x : p;
    path.distances[i] = length(vertex.x - previous);
    const bool flat =
        vertex.g.gradient(0) == 0 && vertex.g.gradient(1) == 0 && vertex.g.gradient(2) == 0;
    if (flat || !(path.distances[i] > 0)) {
      path.status = PathStatus::Degenerate;
      return path;
    }
    path.bounces[i] = makeBounce(previous, vertex.x, vertex.g, rest, vertex.index);
    path.status = statusOf(path.bounces[i], path.distances[i]);
    if (path.status != PathStatus::Regular) return path;
    if (i > 0) rest = before(path.bounces[i], path.distances[i]);
  }
  return path;
}

/// x_1' ... x_N' after p has moved by `step`: (4), to `Order` 1 or 2.
template <int Order, class S>
std::vector<Vector<S>> movedPath(const PathExpansion<S>& path, Vector<S> step) {
  std::vector<Vector<S>> moved;
  moved.reserve(path.bounces.size());
  for (std::size_t i = 0; i < path.bounces.size(); ++i) {
    moved.push_back(movedPoint<Order>(path.bounces[i], path.distances[i], step));
    step = moved.back() - path.bounces[i].x;
  }
  return moved;
}

/// Where q sees p by way of `points` x_1 ... x_N: at the optical length of the path behind x_N, so
/// that depths keep their order (Fig. 7, for any number of bounces). `indices` of refraction of the
/// N + 1 segments; empty: 1.
template <class S>
Vector<S> virtualVertex(const Vector<S>& p, const std::vector<Vector<S>>& points,
                        const Vector<S>& q, const std::vector<S>& indices = {}) {
  S sum(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const S segment = length(points[i] - (i > 0 ? points[i - 1] : p));
    sum += indices.empty() ? segment : S(segment * indices[i] / indices.back());
  }
  const Vector<S>& x = points.back();
  return x + S(sum / length(x - q)) * (x - q);
}

/// dot(normal, x) = offset, normal of unit length.
template <class S>
struct Plane {
  Vector<S> normal;
  S offset;
};
template <class S>
Vector<S> mirrored(const Plane<S>& plane, const Vector<S>& point) {
  return point - S(2 * (dot(plane.normal, point) - plane.offset)) * plane.normal;
}
/// Reflection points in planes only: exact, by the images of q. False: a segment is parallel to its
/// plane, or p is on the other side.
template <class S>
bool planarPath(const Vector<S>& p, const std::vector<Plane<S>>& planes, const Vector<S>& q,
                std::vector<Vector<S>>& points) {
  // images[i]: q as seen from before plane i
  std::vector<Vector<S>> images(planes.size());
  Vector<S> image = q;
  for (std::size_t i = planes.size(); i-- > 0;) image = images[i] = mirrored(planes[i], image);
  points.clear();
  Vector<S> from = p;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const S near = dot(planes[i].normal, from) - planes[i].offset;
    const S far = dot(planes[i].normal, images[i]) - planes[i].offset;
    if (!(near * far < 0)) return false;
    const S t = near / (near - far);
    points.push_back((S(1) - t) * from + t * images[i]);
    from = points.back();
  }
  return true;
}

/// Solves `size` linear equations, rows of `m` with the right side last, by elimination with row
/// pivots; the solution replaces the right side. False: they are singular.
template <class S>
bool solveLinear(std::vector<S>& m, std::size_t size) {
  using std::abs;
  const auto at = [&](std::size_t row, std::size_t column) -> S& {
    return m[row * (size + 1) + column];
  };
  for (std::size_t c = 0; c < size; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < size; ++r) {
      if (abs(at(r, c)) > abs(at(pivot, c))) pivot = r;
    }
    if (!(abs(at(pivot, c)) > 0)) return false;
    for (std::size_t k = 0; k <= size; ++k) std::swap(at(c, k), at(pivot, k));
    for (std::size_t r = c + 1; r < size; ++r) {
      const S factor = at(r, c) / at(c, c);
      if (factor == 0) continue;
      for (std::size_t k = c; k <= size; ++k) at(r, k) -= factor * at(c, k);
    }
  }
  for (std::size_t c = size; c-- > 0;) {
    for (std::size_t k = c + 1; k < size; ++k) at(c, size) -= at(c, k) * at(k, size);
    at(c, size) /= at(c, c);
  }
  return true;
}

/// An exact path near a given one, by Newton's method on its 4 N equations
///   index_{i-1} unit(x_i - x_{i-1}) + index_i unit(x_i - x_{i+1}) + lambda_i g_i' = 0,  g_i = 0.
/// `surface(i, x, jet)` gives the derivatives of x_i's surface and false where there are none.
/// Ends when steps are below `tolerance` times the path's length. `firstStep`: the largest
/// component of the first step, an estimate of the guess's error that is as good as the guess is
/// near.
template <class S, class SurfaceAt>
PathStatus solvePath(const Vector<S>& p, const Vector<S>& q, const SurfaceAt& surface,
                     const S& lastIndex, const S& tolerance, std::vector<PathVertex<S>>& vertices,
                     S* firstStep = nullptr) {
  using std::abs;
  const std::size_t count = vertices.size();
  const std::size_t size = 4 * count;
  std::vector<S> lambda(count);
  constexpr int kMaxSteps = 60;
  for (int iteration = 0; iteration < kMaxSteps; ++iteration) {
    // Rows: the equations; columns: x_i, lambda_i; the last one is the right side.
    std::vector<S> m(size * (size + 1), S(0));
    const auto at = [&](std::size_t row, std::size_t column) -> S& {
      return m[row * (size + 1) + column];
    };
    S total(0);
    for (std::size_t i = 0; i < count; ++i) {
      PathVertex<S>& vertex = vertices[i];
      if (!surface(i, vertex.x, vertex.g)) return PathStatus::Degenerate;
      const Vector<S> gradient{{vertex.g.gradient(0), vertex.g.gradient(1), vertex.g.gradient(2)}};
      const S steepness = length(gradient);
      if (!(steepness > 0)) return PathStatus::Degenerate;
      Vector<S> sum;
      for (const bool ahead : {false, true}) {
        const Vector<S>& other =
            ahead ? (i + 1 < count ? vertices[i + 1].x : q) : (i > 0 ? vertices[i - 1].x : p);
        const S index = ahead ? (i + 1 < count ? vertices[i + 1].index : lastIndex) : vertex.index;
        const S distance = length(vertex.x - other);
        if (!(distance > 0)) return PathStatus::Degenerate;
        const Vector<S> w = S(1 / distance) * (vertex.x - other);
        sum = sum + index * w;
        total += distance;
        for (std::size_t r = 0; r < 3; ++r) {
          for (std::size_t c = 0; c < 3; ++c) {
            const S across = index / distance * (S(r == c ? 1 : 0) - w[r] * w[c]);
            at(4 * i + r, 4 * i + c) += across;
            if (ahead && i + 1 < count) at(4 * i + r, 4 * i + 4 + c) -= across;
            if (!ahead && i > 0) at(4 * i + r, 4 * i - 4 + c) -= across;
          }
        }
      }
      if (iteration == 0) lambda[i] = -dot(sum, gradient) / (steepness * steepness);
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c)
          at(4 * i + r, 4 * i + c) += lambda[i] * vertex.g.hessian(r, c);
        at(4 * i + r, 4 * i + 3) = gradient[r] / steepness;
        at(4 * i + 3, 4 * i + r) = gradient[r] / steepness;
        at(4 * i + r, size) = -(sum[r] + lambda[i] * gradient[r]);
      }
      at(4 * i + 3, size) = -vertex.g.value() / steepness;
    }
    if (!solveLinear(m, size)) return PathStatus::Caustic;
    // Steps of at most a quarter of the mean segment.
    S largest(0);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const S step = abs(at(4 * i + c, size));
        if (!(step <= largest)) largest = step;
      }
    }
    if (iteration == 0 && firstStep) *firstStep = largest;
    const S limit = total / S(8 * static_cast<int>(count));
    const S factor = largest > limit ? S(limit / largest) : S(1);
    for (std::size_t i = 0; i < count; ++i) {
      const Vector<S> gradient{
          {vertices[i].g.gradient(0), vertices[i].g.gradient(1), vertices[i].g.gradient(2)}};
      for (std::size_t c = 0; c < 3; ++c) vertices[i].x[c] += factor * at(4 * i + c, size);
      lambda[i] += factor * at(4 * i + 3, size) / length(gradient);
    }
    if (!(largest <= total)) continue;
    if (largest <= tolerance * total) {
      for (std::size_t i = 0; i < count; ++i) {
        if (!surface(i, vertices[i].x, vertices[i].g)) return PathStatus::Degenerate;
      }
      return PathStatus::Regular;
    }
  }
  return PathStatus::NotConverged;
}

}  // namespace catoptric::methods::perturbation
