#include "scene/paths/curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace catoptric::scene {
namespace {

constexpr std::size_t kArcSteps = 64;  ///< chords per span of the arc length table; ours

/// Index of the span of sorted `keys` that holds `x`.
std::size_t spanOf(const std::vector<double>& keys, double x) {
  const auto above = std::upper_bound(keys.begin(), keys.end(), x);
  const auto index = std::max<std::ptrdiff_t>(above - keys.begin() - 1, 0);
  return std::min(static_cast<std::size_t>(index), keys.size() - 2);
}

/// Rotation vector (axis times angle, rad) of a unit quaternion, angle at most pi.
Vec3 rotationVector(Quat q) {
  if (q.w < 0.0f) q = -q;
  const Vec3 v(q.x, q.y, q.z);
  const float sine = glm::length(v);
  if (sine < 1e-7f) return 2.0f * v;
  return v * (2.0f * std::atan2(sine, q.w) / sine);
}

Quat rotationFromVector(const Vec3& v) {
  const float angle = glm::length(v);
  if (angle < 1e-7f) return glm::normalize(Quat(1.0f, 0.5f * v.x, 0.5f * v.y, 0.5f * v.z));
  const Vec3 axis = v / angle;
  return Quat(std::cos(0.5f * angle), std::sin(0.5f * angle) * axis);
}

}  // namespace

MonotoneCubic::MonotoneCubic(std::vector<double> x, std::vector<double> y)
    : x_(std::move(x)), y_(std::move(y)), slope_(x_.size(), 0.0) {
  assert(x_.size() == y_.size() && !x_.empty());
  const std::size_t n = x_.size();
  if (n < 2) return;
  const auto secant = [&](std::size_t i) { return (y_[i + 1] - y_[i]) / (x_[i + 1] - x_[i]); };
  slope_.front() = secant(0);
  slope_.back() = secant(n - 2);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    // The weighted harmonic mean keeps the cubic monotone; zero at extrema.
    const double a = secant(i - 1);
    const double b = secant(i);
    if (a * b <= 0.0) continue;
    const double ha = x_[i] - x_[i - 1];
    const double hb = x_[i + 1] - x_[i];
    slope_[i] = 3.0 * (ha + hb) / ((2.0 * hb + ha) / a + (hb + 2.0 * ha) / b);
  }
}

double MonotoneCubic::at(double x) const {
  if (x_.size() < 2 || x <= x_.front()) return y_.front();
  if (x >= x_.back()) return y_.back();
  const std::size_t i = spanOf(x_, x);
  const double h = x_[i + 1] - x_[i];
  const double t = (x - x_[i]) / h;
  const double t2 = t * t;
  const double t3 = t2 * t;
  return (2.0 * t3 - 3.0 * t2 + 1.0) * y_[i] + (t3 - 2.0 * t2 + t) * h * slope_[i] +
         (3.0 * t2 - 2.0 * t3) * y_[i + 1] + (t3 - t2) * h * slope_[i + 1];
}

ArcLengthCurve::ArcLengthCurve(std::vector<Vec3> points, bool closed)
    : points_(std::move(points)), closed_(closed && points_.size() > 2) {
  assert(!points_.empty());
  const std::size_t spans = closed_ ? points_.size() : points_.size() - 1;
  keyLength_.push_back(0.0);
  for (std::size_t s = 0; s < spans; ++s) {
    std::vector<double> table{0.0};
    Vec3 previous = point(s, 0.0);
    for (std::size_t k = 1; k <= kArcSteps; ++k) {
      const Vec3 next = point(s, static_cast<double>(k) / kArcSteps);
      table.push_back(table.back() + static_cast<double>(glm::length(next - previous)));
      previous = next;
    }
    keyLength_.push_back(keyLength_.back() + table.back());
    table_.push_back(std::move(table));
  }
}

Vec3 ArcLengthCurve::point(std::size_t span, double t) const {
  const auto n = static_cast<std::ptrdiff_t>(points_.size());
  const auto key = [&](std::ptrdiff_t i) {
    if (closed_) return glm::dvec3(points_[static_cast<std::size_t>((i % n + n) % n)]);
    // Open ends: mirror the neighbour at the end point.
    if (i < 0) return 2.0 * glm::dvec3(points_[0]) - glm::dvec3(points_[1]);
    if (i >= n) {
      return 2.0 * glm::dvec3(points_[static_cast<std::size_t>(n - 1)]) -
             glm::dvec3(points_[static_cast<std::size_t>(n - 2)]);
    }
    return glm::dvec3(points_[static_cast<std::size_t>(i)]);
  };
  const auto i = static_cast<std::ptrdiff_t>(span);
  const glm::dvec3 p0 = key(i - 1);
  const glm::dvec3 p1 = key(i);
  const glm::dvec3 p2 = key(i + 1);
  const glm::dvec3 p3 = key(i + 2);
  const double d1 = std::sqrt(glm::length(p2 - p1));
  if (d1 < 1e-9) return Vec3(p1);
  // Knots a square root of the distance apart; coinciding neighbours count as mirrored ones.
  double d0 = std::sqrt(glm::length(p1 - p0));
  double d2 = std::sqrt(glm::length(p3 - p2));
  if (d0 < 1e-9) d0 = d1;
  if (d2 < 1e-9) d2 = d1;
  // Tangents with respect to t in [0, 1] of the Barry-Goldman pyramid.
  const glm::dvec3 m1 = d1 * ((p1 - p0) / d0 - (p2 - p0) / (d0 + d1) + (p2 - p1) / d1);
  const glm::dvec3 m2 = d1 * ((p2 - p1) / d1 - (p3 - p1) / (d1 + d2) + (p3 - p2) / d2);
  const double t2 = t * t;
  const double t3 = t2 * t;
  return Vec3((2.0 * t3 - 3.0 * t2 + 1.0) * p1 + (t3 - 2.0 * t2 + t) * m1 +
              (3.0 * t2 - 2.0 * t3) * p2 + (t3 - t2) * m2);
}

Vec3 ArcLengthCurve::at(double arcLength) const {
  if (points_.size() < 2 || length() <= 0.0) return points_.front();
  double s = arcLength;
  if (closed_) s -= std::floor(s / length()) * length();
  s = std::clamp(s, 0.0, length());
  const std::size_t span = spanOf(keyLength_, s);
  const std::vector<double>& table = table_[span];
  const double inSpan = s - keyLength_[span];
  const std::size_t k = spanOf(table, inSpan);
  const double chord = table[k + 1] - table[k];
  const double t = (static_cast<double>(k) + (chord > 0.0 ? (inSpan - table[k]) / chord : 0.0)) /
                   static_cast<double>(kArcSteps);
  return point(span, std::clamp(t, 0.0, 1.0));
}

Vec3 ArcLengthCurve::tangent(double arcLength) const {
  const double h = 1e-3 * length();
  const double low = closed_ ? arcLength - h : std::max(arcLength - h, 0.0);
  const double high = closed_ ? arcLength + h : std::min(arcLength + h, length());
  return normalizedOr(at(high) - at(low), Vec3(0.0f));
}

TimedCurve::TimedCurve(std::vector<Vec3> points, std::vector<double> times, bool closed)
    : curve_(std::move(points), closed), arcLength_(std::move(times), curve_.keyLengths()) {}

Vec3 TimedCurve::at(double time) const {
  // The clamp keeps a closed curve's end at its end.
  return curve_.at(std::min(arcLength_.at(time), curve_.length()));
}

Quat slerpShortest(const Quat& a, const Quat& b, double t) {
  const Quat near = glm::dot(a, b) < 0.0f ? -b : b;
  const double cosine = std::min(1.0, static_cast<double>(glm::dot(a, near)));
  const double angle = std::acos(cosine);
  if (angle < 1e-4) {
    return glm::normalize(a * static_cast<float>(1.0 - t) + near * static_cast<float>(t));
  }
  const double inverse = 1.0 / std::sin(angle);
  return glm::normalize(a * static_cast<float>(std::sin((1.0 - t) * angle) * inverse) +
                        near * static_cast<float>(std::sin(t * angle) * inverse));
}

TimedRotation::TimedRotation(std::vector<Quat> keys, std::vector<double> times)
    : keys_(std::move(keys)), times_(std::move(times)), velocity_(keys_.size(), Vec3(0.0f)) {
  assert(keys_.size() == times_.size() && !keys_.empty());
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    keys_[i] = glm::normalize(keys_[i]);
    if (i > 0 && glm::dot(keys_[i], keys_[i - 1]) < 0.0f) keys_[i] = -keys_[i];
  }
  // Angular velocity at inner keys: mean of the neighbouring spans', weighted as a parabola's.
  for (std::size_t i = 1; i + 1 < keys_.size(); ++i) {
    const auto before = static_cast<float>(times_[i] - times_[i - 1]);
    const auto after = static_cast<float>(times_[i + 1] - times_[i]);
    const Vec3 in = rotationVector(glm::conjugate(keys_[i - 1]) * keys_[i]) / before;
    const Vec3 out = rotationVector(glm::conjugate(keys_[i]) * keys_[i + 1]) / after;
    velocity_[i] = (in * after + out * before) / (before + after);
  }
  if (keys_.size() > 1) {
    const std::size_t n = keys_.size();
    velocity_[0] = rotationVector(glm::conjugate(keys_[0]) * keys_[1]) /
                   static_cast<float>(times_[1] - times_[0]);
    velocity_[n - 1] = rotationVector(glm::conjugate(keys_[n - 2]) * keys_[n - 1]) /
                       static_cast<float>(times_[n - 1] - times_[n - 2]);
  }
}

Quat TimedRotation::at(double time) const {
  if (keys_.size() < 2 || time <= times_.front()) return keys_.front();
  if (time >= times_.back()) return keys_.back();
  const std::size_t i = spanOf(times_, time);
  const double h = times_[i + 1] - times_[i];
  const double t = (time - times_[i]) / h;
  const auto third = static_cast<float>(h / 3.0);
  // De Casteljau's construction with spherical interpolation.
  const Quat a = keys_[i];
  const Quat b = a * rotationFromVector(velocity_[i] * third);
  const Quat d = keys_[i + 1];
  const Quat c = d * rotationFromVector(-velocity_[i + 1] * third);
  const Quat ab = slerpShortest(a, b, t);
  const Quat bc = slerpShortest(b, c, t);
  const Quat cd = slerpShortest(c, d, t);
  return slerpShortest(slerpShortest(ab, bc, t), slerpShortest(bc, cd, t), t);
}

}  // namespace catoptric::scene
