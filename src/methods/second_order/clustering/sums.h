// Sums over samples, and the properties of a cluster that follow from them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/math.h"
#include "methods/second_order/clustering/types.h"
#include "methods/second_order/lanes.h"

namespace catoptric::methods::second_order {

/// Sums over samples. Positions are relative to a point near the samples, so that floats represent
/// the shape of small clusters far from the eye.
struct Sums {
  std::uint32_t samples = 0;
  float lobe = 0.0f;  ///< largest scene::Lobe::code
  glm::dvec3 position{0.0};
  glm::dvec3 normal{0.0};
  glm::dvec3 squares{0.0};   ///< sums of xx, yy, zz of positions
  glm::dvec3 products{0.0};  ///< sums of xy, yz, zx of positions
  double dot = 0.0;          ///< sum of dot(position, normal)
  int left = 1 << 30, top = 1 << 30, right = 0, bottom = 0;

  void add(const Sums& s) {
    samples += s.samples;
    lobe = std::max(lobe, s.lobe);
    position += s.position;
    normal += s.normal;
    squares += s.squares;
    products += s.products;
    dot += s.dot;
    left = std::min(left, s.left);
    right = std::max(right, s.right);
    top = std::min(top, s.top);
    bottom = std::max(bottom, s.bottom);
  }
  void add(const VectorArrays& positions, const VectorArrays& normals, const SampleRun& run, int y,
           const Vec3& anchor) {
    Lanes3 p{}, n{}, pp{}, pq{};
    Floats4 pn{};
    for (std::size_t k = 0; k < run.count; k += kLanes) {
      const std::size_t there = run.count - k;
      Lanes3 at = minus(positions.load(run.first + k, there), anchor);
      Lanes3 turned = normals.load(run.first + k, there);
      if (there < kLanes) {
        for (Floats4* values : {&at.x, &at.y, &at.z, &turned.x, &turned.y, &turned.z}) {
          *values = valid(there) ? *values : Floats4{};
        }
      }
      p = {p.x + at.x, p.y + at.y, p.z + at.z};
      n = {n.x + turned.x, n.y + turned.y, n.z + turned.z};
      pp = {pp.x + at.x * at.x, pp.y + at.y * at.y, pp.z + at.z * at.z};
      pq = {pq.x + at.x * at.y, pq.y + at.y * at.z, pq.z + at.z * at.x};
      pn += methods::dot(at, turned);
    }
    const auto sum = [](const Lanes3& v) { return glm::dvec3(sumOf(v.x), sumOf(v.y), sumOf(v.z)); };
    samples += run.count;
    position += sum(p);
    normal += sum(n);
    squares += sum(pp);
    products += sum(pq);
    dot += static_cast<double>(sumOf(pn));
    left = std::min(left, static_cast<int>(run.x));
    right = std::max(right, run.x + run.count);
    top = std::min(top, y);
    bottom = std::max(bottom, y + 1);
  }
};

/// Sets the properties of a cluster that follow from the sums over its samples. `anchor`: the point
/// to which the positions are relative.
void describe(const Sums& all, const Vec3& anchor, Cluster& cluster);

}  // namespace catoptric::methods::second_order
