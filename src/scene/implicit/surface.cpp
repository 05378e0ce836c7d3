#include "scene/implicit/surface.h"

#include <cmath>

#include "core/error.h"

namespace catoptric::implicit {
namespace {

Interval coordinate(const Domain& d, int axis) {
  return {d.min[axis], d.max[axis]};
}

double largest(const glm::dmat3& m) {
  double v = 0.0;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) v = std::max(v, std::abs(m[c][r]));
  }
  return v;
}

}  // namespace

std::string_view nameOf(PointStatus status) {
  switch (status) {
    case PointStatus::Smooth:
      return "smooth";
    case PointStatus::NotFinite:
      return "value not finite";
    case PointStatus::NoGradient:
      return "no gradient";
    default:
      return "zero gradient";
  }
}

Surface placed(Surface surface, const glm::dmat3& linear, const Point& offset) {
  const glm::dmat3 inverse = glm::inverse(linear);
  const bool finite = std::isfinite(largest(inverse)) && std::isfinite(largest(linear)) &&
                      std::isfinite(glm::dot(offset, Point(1.0)));
  if (!finite || glm::determinant(linear) == 0.0)
    throw SceneError("implicit surface: its placement cannot be inverted");
  // local = old(inverse (world - offset))
  const Affine old = surface.localFromWorld;
  surface.localFromWorld.linear = old.linear * inverse;
  surface.localFromWorld.offset = old.offset - surface.localFromWorld.linear * offset;
  return surface;
}

double valueAt(const Surface& surface, const Point& world) {
  const Point p = surface.localFromWorld(world);
  return Evaluator<double>(surface.tape)(p.x, p.y, p.z);
}

Interval valueIn(const Surface& surface, const Domain& local) {
  return Evaluator<Interval>(surface.tape)(coordinate(local, 0), coordinate(local, 1),
                                           coordinate(local, 2));
}

PointStatus derivativesAt(const Surface& surface, const Point& world, Jet3<double>& out) {
  const auto seeds =
      seedsAt<double>(surface.localFromWorld, std::array<double, 3>{world.x, world.y, world.z});
  Evaluator<Jet3<double>> evaluate(surface.tape);
  out = evaluate(seeds[0], seeds[1], seeds[2]);
  if (!std::isfinite(out.c[0])) return PointStatus::NotFinite;
  for (const double v : out.c) {
    if (!std::isfinite(v)) return PointStatus::NoGradient;
  }
  const double gradient = std::hypot(out.c[1], out.c[2], out.c[3]);
  double hessian = 0.0;
  for (std::size_t i = 4; i < 10; ++i) hessian = std::max(hessian, std::abs(out.c[i]));
  const double worldDiameter = surface.domain.diameter() / largest(surface.localFromWorld.linear);
  if (gradient == 0.0 || gradient < kZeroGradient * worldDiameter * hessian)
    return PointStatus::ZeroGradient;
  return PointStatus::Smooth;
}

Domain boundsOf(const Surface& surface) {
  // Depth-first over octants that may hold the surface.
  constexpr int kDepth = 5;
  struct Cell {
    Domain box;
    int depth;
  };
  Evaluator<Interval> evaluate(surface.tape);
  std::vector<Cell> stack{{surface.domain, 0}};
  Domain local;
  while (!stack.empty()) {
    const Cell cell = stack.back();
    stack.pop_back();
    // Nothing new inside what is found already.
    if (!local.empty() && local.contains(cell.box.min) && local.contains(cell.box.max)) continue;
    const Interval value =
        evaluate(coordinate(cell.box, 0), coordinate(cell.box, 1), coordinate(cell.box, 2));
    if (value.undefined() || !value.containsZero()) continue;
    if (cell.depth == kDepth) {
      local.extend(cell.box.min);
      local.extend(cell.box.max);
      continue;
    }
    const Point middle = 0.5 * (cell.box.min + cell.box.max);
    for (int octant = 0; octant < 8; ++octant) {
      Domain child = cell.box;
      for (int axis = 0; axis < 3; ++axis)
        ((octant >> axis) & 1 ? child.min : child.max)[axis] = middle[axis];
      stack.push_back({child, cell.depth + 1});
    }
  }
  if (local.empty()) return local;
  const glm::dmat3 worldFromLocal = glm::inverse(surface.localFromWorld.linear);
  Domain world;
  for (int corner = 0; corner < 8; ++corner) {
    Point p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = ((corner >> axis) & 1 ? local.max : local.min)[axis];
    world.extend(worldFromLocal * (p - surface.localFromWorld.offset));
  }
  return world;
}

}  // namespace catoptric::implicit
