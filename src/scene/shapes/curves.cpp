#include <algorithm>
#include <cmath>

#include "scene/shapes/builder.h"
#include "scene/shapes/shapes.h"

namespace catoptric::scene {
namespace {

/// Cosine and sine of i / n turns.
Vec2 ringPoint(int i, int n) {
  const int k = i % n;
  const double angle = 2.0 * std::numbers::pi * k / n;
  return {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
}

template <class V>
struct Cubic {
  V p0, p1, p2, p3;

  V at(float t) const {
    const float s = 1.0f - t;
    return s * s * s * p0 + 3.0f * s * s * t * p1 + 3.0f * s * t * t * p2 + t * t * t * p3;
  }
  V derivative(float t) const {
    const float s = 1.0f - t;
    return 3.0f * (s * s * (p1 - p0) + 2.0f * s * t * (p2 - p1) + t * t * (p3 - p2));
  }
  /// Unit tangent; at an end whose control points coincide, its limit.
  V tangent(float t) const {
    V d = derivative(t);
    if (glm::dot(d, d) < 1e-16f) d = t < 0.5f ? p2 - p0 : p3 - p1;
    if (glm::dot(d, d) < 1e-16f) d = p3 - p0;
    const float length = glm::length(d);
    return length > 0.0f ? d / length : d;
  }
  float length() const {
    float sum = 0.0f;
    V last = p0;
    for (int k = 1; k <= 16; ++k) {
      const V next = at(fraction(k, 16));
      sum += glm::length(next - last);
      last = next;
    }
    return sum;
  }
};

/// Centripetal Catmull-Rom spans [Yuksel2011] as cubic Bezier pieces; `smooth` false: straight.
template <class V>
std::vector<Cubic<V>> spansThrough(const std::vector<V>& points, bool smooth, bool closed) {
  const auto n = static_cast<std::ptrdiff_t>(points.size());
  const auto key = [&](std::ptrdiff_t i) {
    if (closed) return points[static_cast<std::size_t>((i % n + n) % n)];
    if (i < 0) return 2.0f * points[0] - points[1];
    if (i >= n) {
      return 2.0f * points[static_cast<std::size_t>(n - 1)] -
             points[static_cast<std::size_t>(n - 2)];
    }
    return points[static_cast<std::size_t>(i)];
  };
  std::vector<Cubic<V>> spans;
  for (std::ptrdiff_t i = 0; i < (closed ? n : n - 1); ++i) {
    const V a = key(i);
    const V b = key(i + 1);
    if (!smooth) {
      spans.push_back({a, a + (b - a) / 3.0f, b - (b - a) / 3.0f, b});
      continue;
    }
    const V before = key(i - 1);
    const V after = key(i + 2);
    const float d1 = std::sqrt(glm::length(b - a));
    float d0 = std::sqrt(glm::length(a - before));
    float d2 = std::sqrt(glm::length(after - b));
    if (d1 < 1e-6f) continue;
    if (d0 < 1e-6f) d0 = d1;
    if (d2 < 1e-6f) d2 = d1;
    const V m1 = d1 * ((a - before) / d0 - (b - before) / (d0 + d1) + (b - a) / d1);
    const V m2 = d1 * ((b - a) / d1 - (after - a) / (d1 + d2) + (after - b) / d2);
    spans.push_back({a, a + m1 / 3.0f, b - m2 / 3.0f, b});
  }
  return spans;
}

/// A point of a profile: (r, y), outward normal, arc length; a new run starts at a sharp edge.
struct ProfilePoint {
  Vec2 p;
  Vec2 normal;
  bool startsRun = false;
};

Vec2 outward(const Vec2& tangent) {
  return {tangent.y, -tangent.x};
}

/// Samples of the profile with exact normals; neighbours within the smooth angle share one.
std::vector<ProfilePoint> sampleProfile(const RevolutionShape& shape) {
  std::vector<ProfilePoint> samples;
  if (shape.curve == ProfileCurve::Polynomial) {
    for (int k = 0; k <= shape.along; ++k) {
      const float y = shape.range.x + (shape.range.y - shape.range.x) * fraction(k, shape.along);
      float r = 0.0f;
      float slope = 0.0f;
      for (std::size_t c = shape.coefficients.size(); c-- > 0;) {
        slope = slope * y + r;
        r = r * y + shape.coefficients[c];
      }
      samples.push_back({{std::max(r, 0.0f), y}, glm::normalize(Vec2(1.0f, -slope)), k == 0});
    }
    return samples;
  }

  std::vector<Cubic<Vec2>> spans;
  if (shape.curve == ProfileCurve::Bezier) {
    for (std::size_t i = 0; i + 3 < shape.profile.size(); i += 3) {
      spans.push_back(
          {shape.profile[i], shape.profile[i + 1], shape.profile[i + 2], shape.profile[i + 3]});
    }
  } else {
    spans = spansThrough(shape.profile, shape.curve == ProfileCurve::CatmullRom, false);
  }
  float total = 0.0f;
  for (const auto& span : spans) total += span.length();
  const float cosSmooth = std::cos(shape.smoothAngleRad);
  for (std::size_t s = 0; s < spans.size(); ++s) {
    const float share = spans[s].length() / std::max(total, 1e-12f);
    const int parts =
        shape.curve == ProfileCurve::Polyline
            ? 1
            : std::max(2, static_cast<int>(std::lround(share * static_cast<float>(shape.along))));
    const Vec2 first = outward(spans[s].tangent(0.0f));
    if (s > 0 && glm::dot(samples.back().normal, first) >= cosSmooth) {
      samples.back().normal = glm::normalize(samples.back().normal + first);
    } else {
      samples.push_back({spans[s].p0, first, true});
    }
    for (int k = 1; k <= parts; ++k) {
      const float t = fraction(k, parts);
      samples.push_back({k == parts ? spans[s].p3 : spans[s].at(t), outward(spans[s].tangent(t))});
    }
  }
  for (ProfilePoint& sample : samples) sample.p.x = std::max(sample.p.x, 0.0f);
  return samples;
}

/// Turns a profile about +y, run by run.
void addRevolution(ShapeBuilder& builder, const std::vector<ProfilePoint>& samples, int around,
                   UvMode uv) {
  std::vector<float> arc(samples.size(), 0.0f);
  float widest = 0.0f;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (k > 0) arc[k] = arc[k - 1] + glm::length(samples[k].p - samples[k - 1].p);
    widest = std::max(widest, samples[k].p.x);
  }
  const float length = std::max(arc.back(), 1e-12f);
  const Vec2 extent = uv == UvMode::Metres ? Vec2(2.0f * kPi * widest, length) : Vec2(1.0f);
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin + 1;
    while (end < samples.size() && !samples[end].startsRun) ++end;
    const int rows = static_cast<int>(end - begin) - 1;
    builder.grid(around, rows, false, [&](int i, int j) {
      const std::size_t k = begin + static_cast<std::size_t>(j);
      const ProfilePoint& s = samples[k];
      const bool pole = s.p.x == 0.0f;
      const Vec2 c = ringPoint(i, around);
      const float column = static_cast<float>(i) + (pole ? 0.5f : 0.0f);
      const float angle = 2.0f * kPi * column / static_cast<float>(around);
      const Vec2 side = pole ? Vec2(std::cos(angle), std::sin(angle)) : c;
      // + 0 turns a negative zero into a positive one, so that poles are one point.
      const Vec3 position(s.p.x * c.x + 0.0f, s.p.y, -s.p.x * c.y + 0.0f);
      const Vec3 normal(s.normal.x * side.x, s.normal.y, -s.normal.x * side.y);
      return ShapeVertex{
          position, glm::normalize(normal),
          Vec2(column / static_cast<float>(around), 1.0f - arc[k] / length) * extent};
    });
    begin = end;
  }
}

void addCap(ShapeBuilder& builder, const Vec2& p, bool up, int around, UvMode uv) {
  builder.grid(around, 1, !up, [&](int i, int j) {
    const Vec2 c = ringPoint(i, around);
    const Vec3 position =
        j == 1 ? Vec3(0.0f, p.y, 0.0f) : Vec3(p.x * c.x + 0.0f, p.y, -p.x * c.y + 0.0f);
    const Vec2 flat(position.x, up ? position.z : -position.z);
    return ShapeVertex{position, Vec3(0.0f, up ? 1.0f : -1.0f, 0.0f),
                       uv == UvMode::Metres ? flat : 0.5f + 0.5f * flat / p.x};
  });
}

/// Half a circle from the outer to the inner wall (or back), smooth on both sides.
void addRim(std::vector<ProfilePoint>& samples, const ProfilePoint& from, const Vec2& to,
            const Vec2& forward) {
  constexpr int kRimSegments = 6;
  const Vec2 centre = 0.5f * (from.p + to);
  const Vec2 radius = from.p - centre;
  const float size = glm::length(radius);
  for (int k = 1; k < kRimSegments; ++k) {
    const float angle = kPi * fraction(k, kRimSegments);
    const Vec2 offset = std::cos(angle) * radius + std::sin(angle) * size * forward;
    samples.push_back({centre + offset, glm::normalize(offset)});
  }
}

}  // namespace

Mesh makeRevolution(const RevolutionShape& shape, UvMode uv) {
  std::vector<ProfilePoint> outer = sampleProfile(shape);
  ShapeBuilder builder;
  if (shape.thickness <= 0.0f) {
    addRevolution(builder, outer, shape.around, uv);
    if (shape.caps) {
      if (outer.front().p.x > 0.0f) addCap(builder, outer.front().p, false, shape.around, uv);
      if (outer.back().p.x > 0.0f) addCap(builder, outer.back().p, true, shape.around, uv);
    }
    return builder.take();
  }

  // A vessel: outer wall, rim, inner wall, all one profile.
  std::vector<ProfilePoint> whole = outer;
  const auto innerPoint = [&](const ProfilePoint& s) {
    const Vec2 p = s.p - shape.thickness * s.normal;
    // On the axis stays on the axis; an inner wall that crosses it ends there.
    return Vec2(s.p.x == 0.0f ? 0.0f : std::max(p.x, 0.0f), p.y);
  };
  if (outer.back().p.x > 0.0f) {
    const Vec2 forward(-outer.back().normal.y, outer.back().normal.x);
    addRim(whole, outer.back(), innerPoint(outer.back()), forward);
  }
  for (std::size_t k = outer.size(); k-- > 0;) {
    const bool breaks = k + 1 < outer.size() && outer[k + 1].startsRun;
    whole.push_back({innerPoint(outer[k]), -outer[k].normal, breaks});
  }
  if (outer.front().p.x > 0.0f) {
    const Vec2 forward(outer.front().normal.y, -outer.front().normal.x);
    const ProfilePoint last = whole.back();
    addRim(whole, last, outer.front().p, forward);
    whole.push_back({outer.front().p, outer.front().normal});
  }
  addRevolution(builder, whole, shape.around, uv);
  return builder.take();
}

namespace {

/// A cross-section of a tube.
struct Ring {
  Vec3 centre;
  Vec3 tangent;
  float radius;
  float slope;  ///< d radius / d arc length
};

std::vector<Ring> ringsOf(const TubeShape& shape) {
  const std::vector<Cubic<Vec3>> spans = spansThrough(shape.points, shape.smooth, shape.closed);
  const auto radiusAt = [&](std::size_t i) {
    return shape.radii.size() == 1 ? shape.radii[0] : shape.radii[i % shape.radii.size()];
  };
  std::vector<Ring> rings;
  for (std::size_t s = 0; s < spans.size(); ++s) {
    const float slope = (radiusAt(s + 1) - radiusAt(s)) / std::max(spans[s].length(), 1e-9f);
    const int parts = shape.smooth ? shape.along : 1;
    for (int k = s == 0 ? 0 : 1; k <= parts; ++k) {
      const float t = fraction(k, parts);
      rings.push_back({spans[s].at(t), spans[s].tangent(t),
                       radiusAt(s) + (radiusAt(s + 1) - radiusAt(s)) * t, slope});
    }
    // Mitred bends of a polyline: the ring lies in the plane that halves the angle.
    if (!shape.smooth && (s + 1 < spans.size() || shape.closed)) {
      const Vec3 next = spans[(s + 1) % spans.size()].tangent(0.0f);
      rings.back().tangent = normalizedOr(rings.back().tangent + next, next);
    }
  }
  if (!shape.smooth && shape.closed) rings.front().tangent = rings.back().tangent;
  if (shape.closed) rings.back().centre = rings.front().centre;
  return rings;
}

/// Half spheres at the ends; `sides` are the rings' x axes.
void addTubeCaps(ShapeBuilder& builder, const TubeShape& shape, const std::vector<Ring>& rings,
                 const std::vector<Vec3>& sides, const Vec2& extent) {
  constexpr int kCapRings = 5;
  for (int end = 0; end < 2; ++end) {
    const std::size_t k = end == 0 ? 0 : rings.size() - 1;
    const Ring& ring = rings[k];
    const Vec3 out = end == 0 ? -ring.tangent : ring.tangent;
    builder.grid(kCapRings, shape.around, end != 0, [&](int i, int j) {
      const float polar = 0.5f * kPi * fraction(i, kCapRings);
      const Vec2 c = ringPoint(j, shape.around);
      const Vec3 radial = c.x * sides[k] + c.y * glm::cross(ring.tangent, sides[k]);
      const Vec3 normal = i == kCapRings ? out
                          : i == 0
                              ? radial
                              : glm::normalize(std::cos(polar) * radial + std::sin(polar) * out);
      const Vec3 position = i == kCapRings ? ring.centre + ring.radius * out
                            : i == 0       ? ring.centre + ring.radius * radial
                                           : ring.centre + ring.radius * normal;
      return ShapeVertex{position, normal,
                         Vec2(end == 0 ? 0.0f : 1.0f, fraction(j, shape.around)) * extent};
    });
  }
}

}  // namespace

Mesh makeTube(const TubeShape& shape, UvMode uv) {
  const std::vector<Ring> rings = ringsOf(shape);

  // Frames by parallel transport; a closed ring's left-over twist is spread over its length.
  std::vector<Vec3> sides(rings.size());
  const Vec3 helper = std::abs(rings[0].tangent.y) < 0.9f ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
  sides[0] = glm::normalize(glm::cross(helper, rings[0].tangent));
  std::vector<float> arc(rings.size(), 0.0f);
  for (std::size_t k = 1; k < rings.size(); ++k) {
    const Vec3 flat = sides[k - 1] - glm::dot(sides[k - 1], rings[k].tangent) * rings[k].tangent;
    sides[k] = normalizedOr(flat, sides[k - 1]);
    arc[k] = arc[k - 1] + glm::length(rings[k].centre - rings[k - 1].centre);
  }
  const float total = std::max(arc.back(), 1e-9f);
  float twist = 0.0f;
  if (shape.closed) {
    const Vec3 up = glm::cross(rings.back().tangent, sides.back());
    twist = std::atan2(glm::dot(sides[0], up), glm::dot(sides[0], sides.back()));
  }
  float widest = 0.0f;
  for (const Ring& ring : rings) widest = std::max(widest, ring.radius);
  const Vec2 extent = uv == UvMode::Metres ? Vec2(total, 2.0f * kPi * widest) : Vec2(1.0f);

  ShapeBuilder builder;
  const int last = static_cast<int>(rings.size()) - 1;
  builder.grid(last, shape.around, true, [&](int i, int j) {
    const std::size_t k = static_cast<std::size_t>(shape.closed && i == last ? 0 : i);
    const auto at = static_cast<std::size_t>(i);
    const Ring& ring = rings[k];
    const float angle = shape.closed && i == last ? 0.0f : twist * arc[k] / total;
    const Vec3 side =
        std::cos(angle) * sides[k] + std::sin(angle) * glm::cross(ring.tangent, sides[k]);
    const Vec2 c = ringPoint(j, shape.around);
    const Vec3 radial = c.x * side + c.y * glm::cross(ring.tangent, side);
    const Vec3 normal = glm::normalize(radial - ring.slope * ring.tangent);
    return ShapeVertex{ring.centre + ring.radius * radial, normal,
                       Vec2(arc[at] / total, fraction(j, shape.around)) * extent};
  });
  if (!shape.closed && shape.caps) addTubeCaps(builder, shape, rings, sides, extent);
  return builder.take();
}

namespace {

float cross2(const Vec2& a, const Vec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// Triangles of a simple counter-clockwise polygon by ear clipping.
std::vector<std::array<int, 3>> clipEars(const std::vector<Vec2>& polygon) {
  std::vector<int> left(polygon.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = static_cast<int>(i);
  const auto at = [&](int i) { return polygon[static_cast<std::size_t>(i)]; };
  std::vector<std::array<int, 3>> triangles;
  while (left.size() > 3) {
    bool found = false;
    for (std::size_t k = 0; k < left.size() && !found; ++k) {
      const int a = left[(k + left.size() - 1) % left.size()];
      const int b = left[k];
      const int c = left[(k + 1) % left.size()];
      if (cross2(at(b) - at(a), at(c) - at(b)) <= 0.0f) continue;
      const bool empty = std::none_of(left.begin(), left.end(), [&](int p) {
        return p != a && p != b && p != c && cross2(at(b) - at(a), at(p) - at(a)) >= 0.0f &&
               cross2(at(c) - at(b), at(p) - at(b)) >= 0.0f &&
               cross2(at(a) - at(c), at(p) - at(c)) >= 0.0f;
      });
      if (!empty) continue;
      triangles.push_back({a, b, c});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(k));
      found = true;
    }
    // Only collinear or touching corners are left: any of them may go.
    if (!found) left.erase(left.begin());
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace

Mesh makePrism(const std::vector<Vec2>& outline, float height, float bevel, UvMode uv) {
  // In (x, -z) the outline is counter-clockwise as seen from above.
  std::vector<Vec2> polygon;
  for (const Vec2& p : outline) polygon.emplace_back(p.x, -p.y);
  float area = 0.0f;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    area += cross2(polygon[i], polygon[(i + 1) % polygon.size()]);
  }
  if (area < 0.0f) std::reverse(polygon.begin(), polygon.end());
  const std::size_t n = polygon.size();
  // The bevel's inner outline: each corner moved in along its mitre.
  std::vector<Vec2> inner = polygon;
  if (bevel > 0.0f) {
    for (std::size_t i = 0; i < n; ++i) {
      const Vec2 in = glm::normalize(polygon[i] - polygon[(i + n - 1) % n]);
      const Vec2 out = glm::normalize(polygon[(i + 1) % n] - polygon[i]);
      const Vec2 normalIn(-in.y, in.x);
      const Vec2 normalOut(-out.y, out.x);
      const Vec2 mitre = normalIn + normalOut;
      inner[i] += mitre * (2.0f * bevel / std::max(glm::dot(mitre, mitre), 0.1f));
    }
  }
  Vec2 low = polygon[0];
  Vec2 high = polygon[0];
  for (const Vec2& p : polygon) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const Vec2 flatScale = uv == UvMode::Metres ? Vec2(1.0f) : 1.0f / (high - low);
  const auto point = [](const Vec2& p, float y) { return Vec3(p.x, y, -p.y); };

  ShapeBuilder builder;
  // Sides: bottom bevel, wall, top bevel; flat shaded.
  float perimeter = 0.0f;
  for (std::size_t i = 0; i < n; ++i) perimeter += glm::length(polygon[(i + 1) % n] - polygon[i]);
  const float uScale = uv == UvMode::Metres ? 1.0f : 1.0f / perimeter;
  const float vScale = uv == UvMode::Metres ? 1.0f : 1.0f / height;
  float along = 0.0f;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = (i + 1) % n;
    const float next = along + glm::length(polygon[k] - polygon[i]);
    const auto band = [&](const Vec2& a, const Vec2& b, float y0, const Vec2& c, const Vec2& d,
                          float y1) {
      const Vec3 normal = normalizedOr(
          glm::cross(point(b, y0) - point(a, y0), point(d, y1) - point(a, y0)), Vec3(0, 1, 0));
      const auto v = [&](const Vec2& p, float y, float u) {
        return builder.vertex(point(p, y), normal, {u * uScale, (height - y) * vScale});
      };
      builder.quad(v(a, y0, along), v(b, y0, next), v(c, y1, next), v(d, y1, along));
    };
    if (bevel > 0.0f) {
      band(inner[i], inner[k], 0.0f, polygon[k], polygon[i], bevel);
      band(polygon[i], polygon[k], height - bevel, inner[k], inner[i], height);
    }
    band(polygon[i], polygon[k], bevel, polygon[k], polygon[i], height - bevel);
    along = next;
  }
  // Caps.
  const auto triangles = clipEars(inner);
  for (int side = 0; side < 2; ++side) {
    const bool up = side == 0;
    const auto first = static_cast<std::uint32_t>(builder.mesh().positions.size());
    for (const Vec2& p : inner) {
      builder.vertex(point(p, up ? height : 0.0f), Vec3(0.0f, up ? 1.0f : -1.0f, 0.0f),
                     Vec2(p.x - low.x, up ? high.y - p.y : p.y - low.y) * flatScale);
    }
    for (const auto& t : triangles) {
      const auto a = first + static_cast<std::uint32_t>(t[0]);
      const auto b = first + static_cast<std::uint32_t>(t[1]);
      const auto c = first + static_cast<std::uint32_t>(t[2]);
      up ? builder.triangle(a, b, c) : builder.triangle(a, c, b);
    }
  }
  return builder.take();
}

Mesh makePolygons(const std::vector<Vec3>& vertices, const std::vector<std::vector<int>>& faces,
                  bool smooth, UvMode uv) {
  ShapeBuilder builder;
  // Area-weighted vertex normals (Newell's sums) for smooth surfaces.
  std::vector<Vec3> faceNormals;
  std::vector<Vec3> vertexNormals(vertices.size(), Vec3(0.0f));
  Box3 bounds;
  for (const std::vector<int>& face : faces) {
    Vec3 sum(0.0f);
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Vec3& a = vertices[static_cast<std::size_t>(face[k])];
      const Vec3& b = vertices[static_cast<std::size_t>(face[(k + 1) % face.size()])];
      sum += glm::cross(a, b);
      bounds.extend(a);
    }
    faceNormals.push_back(sum);
    for (const int v : face) vertexNormals[static_cast<std::size_t>(v)] += sum;
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Vec3 flat = normalizedOr(faceNormals[f], Vec3(0, 1, 0));
    // uv on the face's plane: u horizontal, v downwards (or along z for level faces).
    const Vec3 right =
        normalizedOr(glm::cross(std::abs(flat.y) > 0.999f ? Vec3(0, 0, -1) : Vec3(0, 1, 0), flat),
                     Vec3(1, 0, 0));
    const Vec3 up = glm::cross(flat, right);
    Vec2 low(1e30f);
    Vec2 high(-1e30f);
    for (const int v : faces[f]) {
      const Vec3& p = vertices[static_cast<std::size_t>(v)];
      const Vec2 st(glm::dot(p, right), -glm::dot(p, up));
      low = glm::min(low, st);
      high = glm::max(high, st);
    }
    std::vector<std::uint32_t> corner;
    for (const int v : faces[f]) {
      const Vec3& p = vertices[static_cast<std::size_t>(v)];
      Vec2 st = Vec2(glm::dot(p, right), -glm::dot(p, up)) - low;
      if (uv == UvMode::Unit) st /= glm::max(high - low, Vec2(1e-9f));
      corner.push_back(builder.vertex(
          p, smooth ? normalizedOr(vertexNormals[static_cast<std::size_t>(v)], flat) : flat, st));
    }
    for (std::size_t k = 1; k + 1 < corner.size(); ++k) {
      builder.triangle(corner[0], corner[k], corner[k + 1]);
    }
  }
  return builder.take();
}

}  // namespace catoptric::scene
