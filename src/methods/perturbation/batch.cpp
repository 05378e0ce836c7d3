#include "methods/perturbation/batch.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

namespace catoptric::methods::perturbation {
namespace {

constexpr std::size_t kLanes = 4;

/// Four floats with the arithmetic of a scalar.
struct Lanes {
  using Four = float __attribute__((vector_size(16)));
  Four v{};

  Lanes() = default;
  explicit Lanes(float s) : v{s, s, s, s} {}
  explicit Lanes(Four four) : v(four) {}
  Lanes& operator+=(const Lanes& b) {
    v += b.v;
    return *this;
  }
};
Lanes operator+(const Lanes& a, const Lanes& b) {
  return Lanes(a.v + b.v);
}
Lanes operator-(const Lanes& a, const Lanes& b) {
  return Lanes(a.v - b.v);
}
Lanes operator-(const Lanes& a) {
  return Lanes(-a.v);
}
Lanes operator*(const Lanes& a, const Lanes& b) {
  return Lanes(a.v * b.v);
}
Lanes operator/(const Lanes& a, const Lanes& b) {
  return Lanes(a.v / b.v);
}
Lanes sqrt(const Lanes& a) {
  return Lanes(
      Lanes::Four{std::sqrt(a.v[0]), std::sqrt(a.v[1]), std::sqrt(a.v[2]), std::sqrt(a.v[3])});
}

/// Up to four vertices; those that are missing repeat the last.
struct Four {
  std::array<const VertexMove*, kLanes> vertices;
  explicit Four(std::span<const VertexMove> all, std::size_t first) {
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      vertices[lane] = &all[std::min(first + lane, all.size() - 1)];
  }
  template <class Value>
  Lanes gather(const Value& value) const {
    return Lanes(Lanes::Four{value(*vertices[0]), value(*vertices[1]), value(*vertices[2]),
                             value(*vertices[3])});
  }
};

Bounce<Lanes> gatherBounces(std::span<const BounceRecord> bounces, const Four& four) {
  std::array<Lanes, 32> columns;
  std::array<const float*, kLanes> rows{};
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    rows[lane] = bounces[four.vertices[lane]->bounce].v.data();
  // Transposes 4 x 4 blocks.
  for (std::size_t i = 0; i < 32; i += 4) {
    std::array<Lanes::Four, kLanes> r;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      std::memcpy(&r[lane], rows[lane] + i, sizeof(Lanes::Four));
    const Lanes::Four a = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5);
    const Lanes::Four b = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5);
    const Lanes::Four c = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7);
    const Lanes::Four d = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
    columns[i] = Lanes(__builtin_shufflevector(a, b, 0, 1, 4, 5));
    columns[i + 1] = Lanes(__builtin_shufflevector(a, b, 2, 3, 6, 7));
    columns[i + 2] = Lanes(__builtin_shufflevector(c, d, 0, 1, 4, 5));
    columns[i + 3] = Lanes(__builtin_shufflevector(c, d, 2, 3, 6, 7));
  }
  Bounce<Lanes> bounce;
  const Lanes* next = columns.data();
  const auto take = [&](auto& values) {
    for (Lanes& value : values) value = *next++;
  };
  take(bounce.e1.v);
  take(bounce.e2.v);
  take(bounce.n.v);
  take(bounce.d.v);
  take(bounce.a);
  take(bounce.k);
  take(bounce.b);
  take(bounce.r0);
  take(bounce.r1);
  return bounce;
}

}  // namespace

BounceRecord recordOf(const Bounce<double>& bounce) {
  BounceRecord record{};
  std::size_t next = 0;
  const auto put = [&](const auto& values) {
    for (const double value : values) record.v[next++] = static_cast<float>(value);
  };
  put(bounce.e1.v);
  put(bounce.e2.v);
  put(bounce.n.v);
  put(bounce.d.v);
  put(bounce.a);
  put(bounce.k);
  put(bounce.b);
  put(bounce.r0);
  put(bounce.r1);
  assert(next == record.v.size());
  return record;
}

std::size_t moveVertices(std::span<const BounceRecord> bounces,
                         std::span<const VertexMove> vertices, int order,
                         std::span<MovedVertex> moved) {
  assert(moved.size() >= vertices.size());
  std::size_t refused = 0;
  for (std::size_t first = 0; first < vertices.size(); first += kLanes) {
    const Four four(vertices, first);
    const Bounce<Lanes> bounce = gatherBounces(bounces, four);
    const Lanes distance = four.gather([](const VertexMove& v) { return v.distance; });
    Vector<Lanes> step;
    for (std::size_t i = 0; i < 3; ++i)
      step[i] = four.gather([i](const VertexMove& v) { return v.step[i]; });
    const Move<Lanes> move = moveOf(bounce, distance, step);
    const Lanes error = remainderOf(move, order, distance, step);
    const Vector<Lanes> sum = order == 1 ? move.linear : move.linear + move.second;
    const std::size_t count = std::min(kLanes, vertices.size() - first);
    for (std::size_t lane = 0; lane < count; ++lane) {
      MovedVertex& out = moved[first + lane];
      out = {{sum[0].v[lane], sum[1].v[lane], sum[2].v[lane]}, error.v[lane]};
      if (std::isfinite(out.move[0]) && std::isfinite(out.move[1]) && std::isfinite(out.move[2])) {
        if (std::isnan(out.error)) out.error = std::numeric_limits<float>::infinity();
        continue;
      }
      out = {{}, std::numeric_limits<float>::infinity()};
      ++refused;
    }
  }
  return refused;
}

void vertexDerivatives(std::span<const BounceRecord> bounces, std::span<const VertexMove> vertices,
                       std::span<DerivativeBlock> blocks) {
  assert(blocks.size() * kLanes >= vertices.size());
  for (std::size_t first = 0; first < vertices.size(); first += kLanes) {
    const Four four(vertices, first);
    const Bounce<Lanes> bounce = gatherBounces(bounces, four);
    const Lanes distance = four.gather([](const VertexMove& v) { return v.distance; });
    const BounceDerivatives<Lanes> d = derivativesOf(bounce, distance);
    std::array<float, kLanes>* out = blocks[first / kLanes].data();
    const auto put = [&](const Lanes& lanes) { std::memcpy(out++, &lanes.v, sizeof(lanes.v)); };
    for (const Vector<Lanes>& row : d.jacobian) {
      for (const Lanes& value : row.v) put(value);
    }
    for (const auto& component : d.hessian) {
      for (const Lanes& value : component) put(value);
    }
  }
}

}  // namespace catoptric::methods::perturbation
