// Curves through timed keys, from which camera paths are made. They pass through every key at its
// time and have a continuous velocity.
#pragma once

#include <vector>

#include "core/math.h"

namespace catoptric::scene {

/// A monotone cubic through (x_i, y_i), x strictly increasing [Fritsch1980]. It never overshoots.
class MonotoneCubic {
 public:
  MonotoneCubic() = default;
  MonotoneCubic(std::vector<double> x, std::vector<double> y);
  double at(double x) const;  ///< clamped to the first and last key

 private:
  std::vector<double> x_, y_, slope_;
};

/// A centripetal Catmull-Rom curve through points [Yuksel2011], with a table of arc lengths. It has
/// no cusps or loops within a span.
class ArcLengthCurve {
 public:
  ArcLengthCurve() = default;
  /// `closed`: the curve returns from the last point to the first.
  ArcLengthCurve(std::vector<Vec3> points, bool closed);

  double length() const { return keyLength_.empty() ? 0.0 : keyLength_.back(); }
  /// Arc length at key i. For a closed curve, the last entry (i = number of points) is the arc
  /// length of its end.
  const std::vector<double>& keyLengths() const { return keyLength_; }
  Vec3 at(double arcLength) const;       ///< clamped; a closed curve wraps
  Vec3 tangent(double arcLength) const;  ///< unit length; zero where all points coincide

 private:
  Vec3 point(std::size_t span, double t) const;  ///< t in [0, 1]

  std::vector<Vec3> points_;
  bool closed_ = false;
  std::vector<double> keyLength_;
  std::vector<std::vector<double>> table_;  ///< per span: arc length at equal steps of t
};

/// Points with times: an ArcLengthCurve whose arc length is a monotone cubic function of time.
class TimedCurve {
 public:
  TimedCurve() = default;
  TimedCurve(std::vector<Vec3> points, std::vector<double> times, bool closed);
  Vec3 at(double time) const;

 private:
  ArcLengthCurve curve_;
  MonotoneCubic arcLength_;
};

/// Orientations with times, as cubic Bezier spans of spherical interpolation [Shoemake1985]. The
/// angular velocity is continuous at the keys. Interpolation between neighbouring keys takes the
/// shorter arc.
class TimedRotation {
 public:
  TimedRotation() = default;
  TimedRotation(std::vector<Quat> keys, std::vector<double> times);
  Quat at(double time) const;

 private:
  std::vector<Quat> keys_;
  std::vector<double> times_;
  std::vector<Vec3> velocity_;  ///< rad/s, in the frame of each key
};

/// Spherical linear interpolation along the shorter arc.
Quat slerpShortest(const Quat& a, const Quat& b, double t);

}  // namespace catoptric::scene
