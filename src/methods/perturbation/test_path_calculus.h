// Whole paths p = x_0, x_1, ..., x_N, x_{N+1} = q over implicit surfaces, for tests: their
// derivatives, their motion when p moves, and exact paths by Newton's method [Mitchell1992].
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

/// J by rows, and H[i] the Hessian of component i (xx, xy, xz, yy, yz, zz).
template <class S>
struct BounceDerivatives {
  std::array<Vector<S>, 3> jacobian;
  std::array<std::array<S, 6>, 3> hessian;
};

/// J and H of a bounce with p at distance rho.
template <class S>
BounceDerivatives<S> derivativesOf(const Bounce<S>& bounce, const S& rho) {
  const std::array<S, 3> inverse = inverseMatrix(bounce, rho);
  std::array<std::array<S, 2>, 3> y;
  std::array<std::array<S, 2>, 3> ky;
  BounceDerivatives<S> result;
  for (std::size_t u = 0; u < 3; ++u) {
    // E^T of the unit vector u
    y[u] = times(inverse, {bounce.e1[u] - bounce.a[0] * bounce.d[u],
                           bounce.e2[u] - bounce.a[1] * bounce.d[u]});
    ky[u] = times(bounce.k, y[u]);
    for (std::size_t i = 0; i < 3; ++i)
      result.jacobian[i][u] = bounce.e1[i] * y[u][0] + bounce.e2[i] * y[u][1];
  }
  for (std::size_t pair = 0; pair < 6; ++pair) {
    const auto [u, v] = kPairs[pair];
    const std::array<S, 2> r = quadraticTerm(bounce, rho, y[u], y[v]);
    const std::array<S, 2> second =
        times(inverse, {r[0] + ky[u][0] * bounce.d[v] + ky[v][0] * bounce.d[u],
                        r[1] + ky[u][1] * bounce.d[v] + ky[v][1] * bounce.d[u]});
    const S normal = form(bounce.b, y[u], y[v]);
    for (std::size_t i = 0; i < 3; ++i) {
      result.hessian[i][pair] =
          bounce.e1[i] * second[0] + bounce.e2[i] * second[1] - bounce.n[i] * normal;
    }
  }
  return result;
}

/// [Chen2000] PathJacHess (Fig. 4, 5), from q to p. `lastIndex`: index of refraction before q.
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

/// Where x moves: Taylor's series to `Order` 1 or 2. (15), (16)
template <int Order, class S>
Vector<S> movedPoint(const Bounce<S>& bounce, const S& rho, const Vector<S>& step) {
  const Move<S> move = moveOf(bounce, rho, step);
  if constexpr (Order == 1) return bounce.x + move.linear;
  return bounce.x + (move.linear + move.second);
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
/// `surface(i, x, jet)` sets `jet` to the derivatives of x_i's surface, and returns false where
/// there are none. Ends when steps are below `tolerance` times the path's length. False: none was
/// found.
template <class S, class SurfaceAt>
bool solvePath(const Vector<S>& p, const Vector<S>& q, const SurfaceAt& surface, const S& lastIndex,
               const S& tolerance, std::vector<PathVertex<S>>& vertices) {
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
      if (!surface(i, vertex.x, vertex.g)) return false;
      const Vector<S> gradient{{vertex.g.gradient(0), vertex.g.gradient(1), vertex.g.gradient(2)}};
      const S steepness = length(gradient);
      if (!(steepness > 0)) return false;
      Vector<S> sum;
      for (const bool ahead : {false, true}) {
        const Vector<S>& other =
            ahead ? (i + 1 < count ? vertices[i + 1].x : q) : (i > 0 ? vertices[i - 1].x : p);
        const S index = ahead ? (i + 1 < count ? vertices[i + 1].index : lastIndex) : vertex.index;
        const S distance = length(vertex.x - other);
        if (!(distance > 0)) return false;
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
    if (!solveLinear(m, size)) return false;
    // Steps of at most a quarter of the mean segment.
    S largest(0);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const S step = abs(at(4 * i + c, size));
        if (!(step <= largest)) largest = step;
      }
    }
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
        if (!surface(i, vertices[i].x, vertices[i].g)) return false;
      }
      return true;
    }
  }
  return false;
}

}  // namespace catoptric::methods::perturbation
