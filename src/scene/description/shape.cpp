// From an object's "shape" to a mesh.
#include <algorithm>
#include <cmath>

#include "scene/description/description.h"

namespace catoptric::scene {
namespace {

using config::Value;

/// Caps a mesh before it is made.
constexpr double kMaxVertices = 20e6;

class ShapeReader {
 public:
  explicit ShapeReader(const Value& object)
      : object_(object),
        shape_(object.get("shape").asString()),
        schema_(objectSchema(shape_)),
        uv_(get("uv").asString() == "metres" ? UvMode::Metres : UvMode::Unit) {}

  Mesh make() {
    if (shape_ == "plane") return plane();
    if (shape_ == "box") return box();
    if (shape_ == "rounded_box") {
      return makeRoundedBox(size3(), number("radius"), integer("rounding"), uv_);
    }
    if (shape_ == "panel") return panel();
    if (shape_ == "sphere") {
      if (object_.has("icosphere")) {
        return makeIcosphere(number("radius"), integer("icosphere"), uv_);
      }
      const glm::ivec2 n = segments2(3, 2);
      return makeSphere(number("radius"), n.x, n.y, uv_);
    }
    if (shape_ == "torus") {
      const glm::ivec2 n = segments2(3, 3);
      return makeTorus(number("radius"), number("tube"), n.x, n.y, uv_);
    }
    if (shape_ == "disk") return disk();
    if (shape_ == "cylinder") {
      const glm::ivec2 n = segments2(3, 1);
      const float radius = number("radius");
      return makeCylinder(radius, object_.has("top") ? number("top") : radius, number("height"),
                          n.x, n.y, get("caps").asBool(), uv_);
    }
    if (shape_ == "teapot") {
      return makeTeapot(number("height"), integer("segments"), get("lid").asBool(), uv_);
    }
    if (shape_ == "revolution") return revolution();
    if (shape_ == "tube") return tube();
    if (shape_ == "prism") {
      std::vector<Vec2> outline;
      for (const Value& p : object_.get("outline").asArray()) outline.push_back(vec2(p));
      const float height = number("height");
      const float bevel = number("bevel");
      if (2.0f * bevel >= height)
        object_.get("bevel").fail("the bevel must be below half of the height");
      return makePrism(outline, height, bevel, uv_);
    }
    if (shape_ == "polygons") return polygons();
    return makeImplicitShape(object_, uv_);
  }

 private:
  Value get(const char* name) const { return config::valueOr(object_, schema_, name); }
  float number(const char* name) const { return static_cast<float>(get(name).asNumber()); }
  int integer(const char* name) const { return static_cast<int>(get(name).asInteger()); }
  static Vec2 vec2(const Value& value) {
    const std::vector<float> v = value.asFloats(2);
    return {v[0], v[1]};
  }
  Vec2 size2() const { return vec2(get("size")); }
  Vec3 size3() const { return get("size").asVec3(); }

  /// "segments": whole numbers of at least `least`; one number alone counts for all.
  std::vector<int> segments(std::vector<int> least) const {
    const Value value = get("segments");
    const std::vector<Value>& items = value.asArray();
    if (items.size() != least.size()) {
      value.fail(value.dump() + " is not an array of " + std::to_string(least.size()) +
                 " whole numbers");
    }
    std::vector<int> result;
    double product = 1.0;
    for (std::size_t i = 0; i < least.size(); ++i) {
      const auto n = static_cast<int>(items[i].asInteger());
      if (n < least[i]) {
        items[i].fail(std::to_string(n) + " is too small; the minimum is " +
                      std::to_string(least[i]));
      }
      product *= n;
      result.push_back(n);
    }
    if (product > kMaxVertices) value.fail("the shape would have more than 20 million vertices");
    return result;
  }
  glm::ivec2 segments2(int leastA, int leastB) const {
    const std::vector<int> n = segments({leastA, leastB});
    return {n[0], n[1]};
  }
  /// Segments of a side of `length` metres under "cell".
  int cells(float length) const {
    const double n = std::ceil(static_cast<double>(length) / object_.get("cell").asNumber() - 1e-4);
    if (n > 4096.0)
      object_.get("cell").fail("the cells are too small: more than 4096 along a side");
    return std::max(1, static_cast<int>(n));
  }

  Mesh plane() const {
    const Vec2 size = size2();
    return makePlane(
        size, object_.has("cell") ? glm::ivec2(cells(size.x), cells(size.y)) : segments2(1, 1),
        uv_);
  }

  Mesh box() const {
    BoxShape box;
    box.size = size3();
    box.inward = get("inward").asBool();
    if (object_.has("cell")) {
      box.segments = {cells(box.size.x), cells(box.size.y), cells(box.size.z)};
    } else {
      const std::vector<int> n = segments({1, 1, 1});
      box.segments = {n[0], n[1], n[2]};
    }
    if (object_.has("faces")) {
      const std::array<std::string, 6> names{"+x", "-x", "+y", "-y", "+z", "-z"};
      box.faces.fill(false);
      if (object_.get("faces").asArray().empty()) {
        object_.get("faces").fail("names no face; give at least one");
      }
      for (const Value& face : object_.get("faces").asArray()) {
        const auto at = std::find(names.begin(), names.end(), face.asString());
        if (at == names.end()) face.fail(face.dump() + " is not one of +x, -x, +y, -y, +z, -z");
        box.faces[static_cast<std::size_t>(at - names.begin())] = true;
      }
    }
    return makeBox(box, uv_);
  }

  Mesh panel() const {
    PanelShape panel;
    panel.size = size2();
    panel.thickness = number("thickness");
    panel.cell = object_.has("cell") ? number("cell") : 0.0f;
    if (panel.cell > 0.0f) {
      cells(panel.size.x);
      cells(panel.size.y);
    }
    if (object_.has("openings")) {
      for (const Value& opening : object_.get("openings").asArray()) {
        const std::vector<float> o = opening.asFloats(4);
        if (!(o[2] > 0.0f && o[3] > 0.0f)) opening.fail("width and height must be above 0");
        panel.openings.emplace_back(o[0], o[1], o[2], o[3]);
      }
    }
    Mesh mesh = makePanel(panel, uv_);
    if (mesh.indices.empty()) object_.fail("the openings cover the whole panel");
    return mesh;
  }

  Mesh disk() const {
    const float radius = number("radius");
    const float inner = number("inner");
    if (inner >= radius) object_.get("inner").fail("the hole must be smaller than the disk");
    if (object_.has("cell")) {
      return makeDisk(radius, inner, std::max(8, cells(2.0f * kPi * radius)), cells(radius - inner),
                      uv_);
    }
    const glm::ivec2 n = segments2(3, 1);
    return makeDisk(radius, inner, n.x, n.y, uv_);
  }

  Mesh revolution() const {
    RevolutionShape shape;
    const std::string curve = get("curve").asString();
    shape.thickness = number("thickness");
    shape.smoothAngleRad = radians(number("smooth_angle"));
    shape.caps = get("caps").asBool();
    const glm::ivec2 n = segments2(3, 1);
    shape.around = n.x;
    shape.along = n.y;
    if (curve == "polynomial") {
      shape.curve = ProfileCurve::Polynomial;
      for (const Value& c : object_.get("coefficients").asArray()) {
        shape.coefficients.push_back(static_cast<float>(c.asNumber()));
      }
      if (shape.coefficients.empty()) object_.fail("a polynomial profile needs \"coefficients\"");
      shape.range = vec2(get("range"));
      if (!(shape.range.y > shape.range.x))
        get("range").fail("the range must be [smaller, larger]");
      return makeRevolution(shape, uv_);
    }
    const Value profile = object_.get("profile");
    for (const Value& point : profile.asArray()) {
      shape.profile.push_back(vec2(point));
      const Vec2 p = shape.profile.back();
      if (p.x < 0.0f) point.fail("a radius must not be below 0");
      if (shape.profile.size() > 1 && curve != "bezier" &&
          p == shape.profile[shape.profile.size() - 2]) {
        point.fail("the point is the same as the one before it");
      }
    }
    const std::size_t count = shape.profile.size();
    if (count < 2) profile.fail("a profile needs at least 2 points");
    shape.curve = ProfileCurve::CatmullRom;
    if (curve == "polyline") shape.curve = ProfileCurve::Polyline;
    if (curve == "bezier") {
      shape.curve = ProfileCurve::Bezier;
      if (count % 3 != 1) {
        profile.fail("a Bezier profile has 3 k + 1 points, not " + std::to_string(count));
      }
    }
    return makeRevolution(shape, uv_);
  }

  Mesh tube() const {
    TubeShape shape;
    for (const Value& point : object_.get("points").asArray()) {
      shape.points.push_back(point.asVec3());
      if (shape.points.size() > 1 && shape.points.back() == shape.points[shape.points.size() - 2]) {
        point.fail("the point is the same as the one before it");
      }
    }
    const Value radius = get("radius");
    if (radius.kind() == Value::Kind::Array) {
      shape.radii = radius.asFloats(shape.points.size());
    } else {
      shape.radii = {static_cast<float>(radius.asNumber())};
    }
    for (const float r : shape.radii) {
      if (!(r > 0.0f)) radius.fail("a radius must be above 0");
    }
    shape.smooth = get("curve").asString() == "catmull_rom";
    shape.closed = get("closed").asBool();
    shape.caps = get("caps").asBool();
    if (shape.closed && shape.points.size() < 3) object_.fail("a closed tube needs 3 points");
    const glm::ivec2 n = segments2(3, 1);
    shape.around = n.x;
    shape.along = n.y;
    return makeTube(shape, uv_);
  }

  Mesh polygons() const {
    std::vector<Vec3> vertices;
    for (const Value& v : object_.get("vertices").asArray()) vertices.push_back(v.asVec3());
    std::vector<std::vector<int>> faces;
    for (const Value& face : object_.get("faces").asArray()) {
      std::vector<int> corners;
      for (const Value& corner : face.asArray()) {
        const std::int64_t index = corner.asInteger();
        if (index < 0 || index >= static_cast<std::int64_t>(vertices.size())) {
          corner.fail(std::to_string(index) + " is not the number of a vertex: they go from 0 to " +
                      std::to_string(vertices.size() - 1));
        }
        corners.push_back(static_cast<int>(index));
      }
      if (corners.size() < 3) face.fail("a face has at least 3 corners");
      if (!hasArea(vertices, corners)) {
        face.fail(face.dump() + " has no area: its corners lie on a line");
      }
      faces.push_back(std::move(corners));
    }
    return makePolygons(vertices, faces, get("smooth").asBool(), uv_);
  }

  /// Newell's sum against the longest edge, in double.
  static bool hasArea(const std::vector<Vec3>& vertices, const std::vector<int>& corners) {
    constexpr double kLeast = 1e-7;  // ours: below it floats do not know the normal
    const auto at = [&](std::size_t k) {
      return glm::dvec3(vertices[static_cast<std::size_t>(corners[k % corners.size()])]);
    };
    glm::dvec3 sum(0.0);
    double longest = 0.0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      sum += glm::cross(at(k) - at(0), at(k + 1) - at(0));
      longest = std::max(longest, glm::length(at(k + 1) - at(k)));
    }
    return glm::length(sum) > kLeast * longest * longest;
  }

  const Value& object_;
  std::string shape_;
  const config::Schema& schema_;
  UvMode uv_;
};

}  // namespace

Mesh makeShape(const Value& object) {
  return ShapeReader(object).make();
}

std::string shapeKey(const Value& object) {
  // All members that are the shape's own, and what else the mesh depends on.
  std::string key;
  const config::Schema& schema = objectSchema(object.get("shape").asString());
  const config::Schema& common = objectSchema("");
  for (const config::Field& field : schema.fields) {
    const bool own = std::none_of(common.fields.begin(), common.fields.end(),
                                  [&](const config::Field& f) { return f.name == field.name; });
    if ((own || field.name == "uv" || field.name == "morph") && object.has(field.name)) {
      key += field.name + "=" + object.get(field.name).dump() + ";";
    }
  }
  return key;
}

MorphShape morphOf(const Value& morph) {
  config::require(morph, morphSchema());
  const auto get = [&](const char* name) { return config::valueOr(morph, morphSchema(), name); };
  const std::string type = morph.get("type").asString();
  MorphShape shape;
  shape.type = type == "wave"    ? MorphType::Wave
               : type == "flag"  ? MorphType::Flag
               : type == "bulge" ? MorphType::Bulge
               : type == "twist" ? MorphType::Twist
                                 : MorphType::Stretch;
  shape.amplitude = static_cast<float>(get("amplitude").asNumber());
  shape.waves = static_cast<float>(get("waves").asNumber());
  const Vec3 axis = get("axis").asVec3();
  if (!(glm::length(axis) > 1e-6f)) morph.get("axis").fail("the axis is the zero vector");
  shape.axis = glm::normalize(axis);
  if (shape.type == MorphType::Stretch && !(shape.amplitude > -0.95f)) {
    morph.get("amplitude").fail("the amplitude of a stretch must be above -0.95");
  }
  return shape;
}

}  // namespace catoptric::scene
