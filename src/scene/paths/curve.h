// Curves through timed keys: what camera paths are made of. They pass through every key at its
// time, and have a continuous velocity in between.
#pragma once

#include <vector>

#include "core/math.h"

namespace catoptric::scene {

/// Monotone cubic through (x_i, y_i), x strictly increasing [Fritsch1980]: never overshoots.
class MonotoneCubic {
 public:
  MonotoneCubic() = default;
  MonotoneCubic(std::vector<double> x, std::vector<double> y);
  double at(double x) const;  ///< clamped to the first and last key

 private:
  std::vector<double> x_, y_, slope_;
};

/// Centripetal Catmull-Rom curve through points [Yuksel2011], no cusps or loops within a span,
/// with an arc length table.
class ArcLengthCurve {
 public:
  ArcLengthCurve() = default;
  /// `closed` returns from the last point to the first.
  ArcLengthCurve(std::vector<Vec3> points, bool closed);

  double length() const { return keyLength_.empty() ? 0.0 : keyLength_.back(); }
  /// Arc length at key i; i = number of points is the end of a closed curve.
  const std::vector<double>& keyLengths() const { return keyLength_; }
  Vec3 at(double arcLength) const;       ///< clamped; a closed curve wraps
  Vec3 tangent(double arcLength) const;  ///< unit length; zero where all points coincide

 private:
  Vec3 point(std::size_t span, double t) const;  ///< t in [0, 1]

  std::vector<Vec3> points_;
  bool closed_ = false;
  std::vector<double> keyLength_;
  std::vector<std::vector<double>> table_;  ///< per span: arc length at even steps of t
};

/// Points with times: the geometry of ArcLengthCurve, its arc length a monotone cubic of time.
class TimedCurve {
 public:
  TimedCurve() = default;
  TimedCurve(std::vector<Vec3> points, std::vector<double> times, bool closed);
  Vec3 at(double time) const;

 private:
  ArcLengthCurve curve_;
  MonotoneCubic arcLength_;
};

/// Orientations with times: cubic Bezier spans of spherical interpolation [Shoemake1985], angular
/// velocity continuous at the keys. Neighbouring keys take the shorter arc.
class TimedRotation {
 public:
  TimedRotation() = default;
  TimedRotation(std::vector<Quat> keys, std::vector<double> times);
  Quat at(double time) const;

 private:
  std::vector<Quat> keys_;
  std::vector<double> times_;
  std::vector<Vec3> velocity_;  ///< rad/s, in each key's own frame
};

/// Spherical linear interpolation along the shorter arc.
Quat slerpShortest(const Quat& a, const Quat& b, double t);

}  // namespace catoptric::scene
