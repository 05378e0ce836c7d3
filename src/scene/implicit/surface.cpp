#include "scene/implicit/surface.h"

#include <cmath>

#include "core/error.h"

namespace catoptric::implicit {

/// Once for each derivative, written out: the compiler knows the indices.
template <class First, class Second>
static void forFirstAndSecond(const First& first, const Second& second) {
  first(0);
  first(1);
  first(2);
  second(0, 0);
  second(0, 1);
  second(0, 2);
  second(1, 1);
  second(1, 2);
  second(2, 2);
}
template <class Third>
static void forThird(const Third& third) {
  third(0, 0, 0);
  third(0, 0, 1);
  third(0, 0, 2);
  third(0, 1, 1);
  third(0, 1, 2);
  third(0, 2, 2);
  third(1, 1, 1);
  third(1, 1, 2);
  third(1, 2, 2);
  third(2, 2, 2);
}

/// A jet whose derivatives above an order are zero: coordinates have those of order 1 alone, their
/// products few more.
struct ShortJet {
  Jet3<double> jet;
  int order = 3;
};
static ShortJet operator+(const ShortJet& a, const ShortJet& b) {
  return {a.jet + b.jet, std::max(a.order, b.order)};
}
static ShortJet operator-(const ShortJet& a, const ShortJet& b) {
  return {a.jet - b.jet, std::max(a.order, b.order)};
}
static ShortJet operator-(const ShortJet& a) {
  return {-a.jet, a.order};
}
static ShortJet operator*(const ShortJet& x, const ShortJet& y) {
  const ShortJet& lower = x.order <= y.order ? x : y;
  const ShortJet& higher = x.order <= y.order ? y : x;
  if (lower.order > 1) return {x.jet * y.jet, 3};
  const Jet3<double>& a = lower.jet;
  const Jet3<double>& b = higher.jet;
  ShortJet r;
  r.order = std::min(3, lower.order + higher.order);
  for (std::size_t i = 0; i < 20; ++i) r.jet.c[i] = a.value() * b.c[i];
  if (lower.order == 0) return r;
  const auto first = [&](std::size_t i) { r.jet.c[1 + i] += a.gradient(i) * b.value(); };
  const auto second = [&](std::size_t i, std::size_t j) {
    r.jet.c[kHessianIndex[i][j]] += a.gradient(i) * b.gradient(j) + a.gradient(j) * b.gradient(i);
  };
  const auto third = [&](std::size_t i, std::size_t j, std::size_t k) {
    r.jet.c[kThirdIndex[i][j][k]] += a.gradient(i) * b.hessian(j, k) +
                                     a.gradient(j) * b.hessian(i, k) +
                                     a.gradient(k) * b.hessian(i, j);
  };
  forFirstAndSecond(first, second);
  if (higher.order > 1) forThird(third);
  return r;
}

template <>
struct Arithmetic<ShortJet> {
  static ShortJet constant(double v) { return {Jet3<double>(v), 0}; }
  static ShortJet apply(Code code, const ShortJet& v, double constant) {
    if (code == Code::Square) return v * v;
    const Chain<double> f = chainOf<3>(code, v.jet.value(), constant);
    const Jet3<double>& u = v.jet;
    ShortJet r;
    r.jet.c[0] = f.f0;
    const auto first = [&](std::size_t i) { r.jet.c[1 + i] = f.f1 * u.gradient(i); };
    const auto second = [&](std::size_t i, std::size_t j) {
      r.jet.c[kHessianIndex[i][j]] =
          f.f1 * u.hessian(i, j) + f.f2 * (u.gradient(i) * u.gradient(j));
    };
    const auto third = [&](std::size_t i, std::size_t j, std::size_t k) {
      r.jet.c[kThirdIndex[i][j][k]] =
          f.f1 * u.third(i, j, k) +
          f.f2 * (u.hessian(i, j) * u.gradient(k) + u.hessian(i, k) * u.gradient(j) +
                  u.hessian(j, k) * u.gradient(i)) +
          f.f3 * (u.gradient(i) * u.gradient(j) * u.gradient(k));
    };
    forFirstAndSecond(first, second);
    forThird(third);
    return r;
  }
  static ShortJet quotient(const ShortJet& a, const ShortJet& b) {
    return a * apply(Code::Divide, b, 0.0);
  }
  static ShortJet smaller(const ShortJet& a, const ShortJet& b) {
    return {Arithmetic<Jet3<double>>::smaller(a.jet, b.jet), 3};
  }
};

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
  Evaluator<ShortJet> evaluate(surface.tape);
  out = evaluate({seeds[0], 1}, {seeds[1], 1}, {seeds[2], 1}).jet;
  if (!std::isfinite(out.c[0])) return PointStatus::NotFinite;
  for (const double v : out.c) {
    if (!std::isfinite(v)) return PointStatus::NoGradient;
  }
  const double gradient = glm::length(Point(out.c[1], out.c[2], out.c[3]));
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
