// Camera paths around a point.
#include <cmath>

#include "config/fields.h"
#include "scene/paths/kinds.h"

namespace catoptric::scene {
namespace {

namespace fields = config::fields;
using config::Schema;
using config::Value;

class OrbitPath : public CommonPath {
 public:
  using CommonPath::CommonPath;

  PathFrame frame(int number) const override {
    const bool loop = radius == radiusEnd && height == heightEnd && !common_.ease;
    const double u = common_.share(number, loop);
    const double angle = startRad + 2.0 * std::numbers::pi * turns * u;
    const double r = radius + (radiusEnd - radius) * u;
    const Vec3 offset(static_cast<float>(r * std::sin(angle)),
                      static_cast<float>(height + (heightEnd - height) * u),
                      static_cast<float>(r * std::cos(angle)));
    return common_.lookingAt(number, centre + offset, target, common_.fovRad);
  }

  Vec3 centre{0.0f};
  Vec3 target{0.0f};
  double radius = 1.0;
  double radiusEnd = 1.0;
  double height = 0.0;
  double heightEnd = 0.0;
  double turns = 1.0;
  double startRad = 0.0;
};

}  // namespace

const Schema& orbitSchema() {
  static const Schema schema{
      "orbit",
      "A circle or a spiral around a point.",
      {
          fields::required(fields::vec3("center", "The point in the middle, in metres.")),
          fields::required(fields::number("radius", "The radius in metres.", "", 0.001)),
          fields::number("height", "How high above the centre the camera is, in metres.", "0"),
          fields::number("turns", "How often it goes around; a negative number goes clockwise.",
                         "1"),
          fields::number(
              "start", "Where it begins, in degrees: 0 sees the centre from +z, 90 from +x.", "0"),
          fields::vec3("target",
                       "The point at which the camera looks, in metres; without it the centre."),
          fields::number("radius_end", "The radius at the end, in metres.", "", 0.001),
          fields::number("height_end", "The height at the end, in metres."),
      }};
  return schema;
}

std::unique_ptr<CameraPath> makeOrbit(const Value& orbit, const PathSettings& common) {
  config::require(orbit, orbitSchema());
  auto path = std::make_unique<OrbitPath>(common);
  const auto number = [&](const char* name) {
    return config::valueOr(orbit, orbitSchema(), name).asNumber();
  };
  path->centre = common.position(orbit.get("center"));
  path->target = orbit.has("target") ? common.position(orbit.get("target")) : path->centre;
  path->radius = metresOf(orbit.get("radius"));
  path->radiusEnd = orbit.has("radius_end") ? metresOf(orbit.get("radius_end")) : path->radius;
  path->height = metresOf(config::valueOr(orbit, orbitSchema(), "height"));
  path->heightEnd = orbit.has("height_end") ? metresOf(orbit.get("height_end")) : path->height;
  path->turns = number("turns");
  path->startRad = number("start") * std::numbers::pi / 180.0;
  return path;
}

}  // namespace catoptric::scene
