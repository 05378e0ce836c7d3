// From an object of the shape "implicit" to a mesh that keeps its surface.
#include <cmath>

#include "core/error.h"
#include "scene/description/description.h"

namespace catoptric::scene {
namespace {

using config::Value;
using implicit::Domain;
using implicit::Point;
using implicit::Surface;

class ImplicitReader {
 public:
  ImplicitReader(const Value& object, UvMode uv)
      : object_(object), schema_(objectSchema("implicit")), uv_(uv) {}

  Mesh make() {
    name_ = object_.get("surface").asString();
    // Errors of the surface (a formula's column, a size of 0) get the object's place.
    try {
      Surface surface = read();
      if (object_.has("bounds") && !needsBounds()) cutOff(surface.domain);
      if (!object_.has("segments")) {
        return makeImplicit(surface, static_cast<int>(get("resolution").asInteger()), uv_);
      }
      if (!profile_.at || object_.has("bounds")) {
        object_.get("segments")
            .fail(
                "\"segments\" is only for sphere, ellipsoid, cylinder, cone, torus, revolution and "
                "vase without \"bounds\"; use \"resolution\" here");
      }
      return makeTurnedImplicit(surface, profile_, segments(), uv_);
    } catch (const SceneError& error) {
      const Value place = name_ == "formula" ? object_.get("formula") : object_.get("surface");
      place.fail(error.what());
    }
  }

 private:
  Value get(const char* name) const { return config::valueOr(object_, schema_, name); }
  double number(const char* name) const { return get(name).asNumber(); }
  bool needsBounds() const { return name_ == "formula" || name_ == "quadric" || name_ == "plane"; }

  std::vector<double> numbers(const Value& value, std::size_t count) const {
    const std::vector<Value>& items = value.asArray();
    if (count != 0 && items.size() != count) {
      value.fail(value.dump() + " is not an array of " + std::to_string(count) + " numbers");
    }
    std::vector<double> result;
    for (const Value& item : items) result.push_back(item.asNumber());
    return result;
  }
  Point point(const Value& value) const {
    const std::vector<double> v = numbers(value, 3);
    return {v[0], v[1], v[2]};
  }
  Value needed(const char* name) const {
    if (!object_.has(name)) {
      object_.fail("the surface \"" + name_ + "\" needs \"" + name + "\"");
    }
    return object_.get(name);
  }

  /// "bounds": a half size, three of them, or least and largest x, y and z.
  Domain bounds() const {
    const Value value = needed("bounds");
    Domain box;
    if (value.kind() != Value::Kind::Array) {
      box = {Point(-value.asNumber()), Point(value.asNumber())};
    } else if (value.asArray().size() == 6) {
      const std::vector<double> v = numbers(value, 6);
      box = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    } else {
      box = {-point(value), point(value)};
    }
    for (int a = 0; a < 3; ++a) {
      if (!(box.max[a] > box.min[a])) {
        value.fail(value.dump() +
                   " encloses nothing; allowed: a half size above 0, 3 half sizes, or [min x, y, "
                   "z, max x, y, z]");
      }
    }
    return box;
  }

  /// The surface's own domain where the bounds leave it.
  void cutOff(Domain& domain) const {
    const Domain box = bounds();
    domain = {glm::max(domain.min, box.min), glm::min(domain.max, box.max)};
    for (int a = 0; a < 3; ++a) {
      if (!(domain.max[a] > domain.min[a])) {
        object_.get("bounds").fail("the surface lies outside of these bounds");
      }
    }
  }

  glm::ivec2 segments() const {
    const Value value = object_.get("segments");
    const std::vector<double> v = numbers(value, 2);
    if (!(v[0] >= 3.0 && v[1] >= 2.0 && v[0] <= 4096.0 && v[1] <= 4096.0 &&
          v[0] == std::floor(v[0]) && v[1] == std::floor(v[1]))) {
      value.fail(value.dump() +
                 " is not allowed: two integers, 3 to 4096 around the axis and 2 to 4096 along it");
    }
    return {static_cast<int>(v[0]), static_cast<int>(v[1])};
  }

  static glm::dvec2 halfCircle(double s) {
    // The poles lie on the axis exactly.
    if (s == 0.0 || s == 1.0) return {0.0, s == 0.0 ? -1.0 : 1.0};
    return {std::sin(std::numbers::pi * s), -std::cos(std::numbers::pi * s)};
  }

  Surface read() {
    if (name_ == "plane") {
      return implicit::planeSurface(point(get("normal")), number("offset"), bounds());
    }
    if (name_ == "sphere") {
      const double r = number("radius");
      profile_ = {halfCircle, Point(r)};
      return implicit::sphereSurface(r);
    }
    if (name_ == "ellipsoid") {
      profile_ = {halfCircle, point(needed("radii"))};
      return implicit::ellipsoidSurface(profile_.scale);
    }
    if (name_ == "cylinder") {
      const double r = number("radius");
      const double h = number("height");
      profile_.at = [=](double s) { return glm::dvec2(r, (s - 0.5) * h); };
      return implicit::cylinderSurface(r, h);
    }
    if (name_ == "cone") {
      const double r = number("radius");
      const double h = number("height");
      profile_.at = [=](double s) { return glm::dvec2(r * (1.0 - s), h * (s - 1.0)); };
      return implicit::coneSurface(r, h);
    }
    if (name_ == "torus") {
      const double r = number("radius");
      const double t = number("tube");
      profile_.at = [=](double s) {
        const double angle = 2.0 * std::numbers::pi * (s == 1.0 ? 0.0 : s);
        return glm::dvec2(r + t * std::cos(angle), t * std::sin(angle));
      };
      return implicit::torusSurface(r, t);
    }
    if (name_ == "quadric") {
      const std::vector<double> c = numbers(needed("coefficients"), 10);
      implicit::QuadricCoefficients all{};
      std::copy(c.begin(), c.end(), all.begin());
      return implicit::quadricSurface(all, bounds());
    }
    if (name_ == "superquadric") {
      const std::vector<double> e = numbers(get("exponents"), 2);
      return implicit::superquadricSurface(point(needed("radii")), e[0], e[1]);
    }
    if (name_ == "metaballs") return metaballs();
    if (name_ == "revolution") {
      const std::vector<double> c = numbers(needed("coefficients"), 0);
      const std::vector<double> range = numbers(get("range"), 2);
      profile_.at = [=](double s) {
        const double y = s == 1.0 ? range[1] : range[0] + s * (range[1] - range[0]);
        double r = 0.0;
        for (auto k = c.rbegin(); k != c.rend(); ++k) r = r * y + *k;
        return glm::dvec2(std::max(0.0, r), y);
      };
      return implicit::revolutionSurface(c, range[0], range[1]);
    }
    if (name_ == "vase") {
      // [Chen2000] Sec. IV
      profile_.at = [](double s) {
        return glm::dvec2(((5.80 * s - 9.78) * s + 3.90) * s + 0.47, 2.0 * s);
      };
      return implicit::vaseSurface();
    }
    if (name_ == "gyroid") {
      return gyroidSurface(number("period"), number("thickness"),
                           object_.has("radius") ? number("radius") : 1.0);
    }
    if (name_ == "heart") return heartSurface();
    if (name_ == "genus2") return genus2Surface();
    if (name_ == "blobby_cube") return blobbyCubeSurface();
    return formula();
  }

  Surface metaballs() const {
    std::vector<glm::dvec4> balls;
    const Value given = needed("balls");
    if (given.asArray().empty()) given.fail("there must be at least one ball");
    for (const Value& ball : given.asArray()) {
      const std::vector<double> b = numbers(ball, 4);
      if (!(b[3] > 0.0)) ball.fail("a radius must be above 0");
      balls.emplace_back(b[0], b[1], b[2], b[3]);
    }
    return implicit::metaballsSurface(balls, number("sharpness"));
  }

  Surface formula() const {
    const std::string text = needed("formula").asString();
    std::vector<implicit::Parameter> parameters;
    if (object_.has("parameters")) {
      const Value values = object_.get("parameters");
      for (const std::string& key : values.keys())
        parameters.emplace_back(key, values.get(key).asNumber());
    }
    return implicit::formulaSurface(text, parameters, bounds());
  }

  const Value& object_;
  const config::Schema& schema_;
  UvMode uv_;
  std::string name_;
  ImplicitProfile profile_;
};

}  // namespace

Mesh makeImplicitShape(const Value& object, UvMode uv) {
  return ImplicitReader(object, uv).make();
}

}  // namespace catoptric::scene
