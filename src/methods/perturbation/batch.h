// The bounce's formulas for four vertices at a time, in float: what updates of virtual objects run.
// Results are moves of the reflection point, so that float's digits are spent on them alone. The
// same for any number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/perturbation/bounce.h"

namespace catoptric::methods::perturbation {

/// A bounce's constants, two cache lines: e1, e2, n, d, a, K, b, R0, R1.
struct alignas(64) BounceRecord {
  std::array<float, 32> v;
};
BounceRecord recordOf(const Bounce<double>& bounce);

/// One vertex: p = x - distance d of a bounce moves by `step`.
struct VertexMove {
  std::uint32_t bounce = 0;  ///< number of its record
  float distance = 0.0f;     ///< from p to x, at least 0
  std::array<float, 3> step{};
};

struct MovedVertex {
  std::array<float, 3> move{};  ///< x' - x
  /// Estimate of its error, of this bounce alone (remainderOf); infinite where the move is not
  /// finite.
  float error = 0.0f;
};

/// x' - x of each vertex to `order` 1 or 2. Returns how many were not finite (p in a focal point);
/// those stay where they are.
std::size_t moveVertices(std::span<const BounceRecord> bounces,
                         std::span<const VertexMove> vertices, int order,
                         std::span<MovedVertex> moved);

/// J by rows, then H of each component (xx, xy, xz, yy, yz, zz), of four vertices: [i][vertex].
using DerivativeBlock = std::array<std::array<float, 4>, 27>;

/// J and H of each vertex (steps are not looked at), in blocks of four; the last one is filled up
/// with its last vertex. Not finite where p is in a focal point.
void vertexDerivatives(std::span<const BounceRecord> bounces, std::span<const VertexMove> vertices,
                       std::span<DerivativeBlock> blocks);

}  // namespace catoptric::methods::perturbation
