// Camera paths around a point.
#include <cmath>

#include "scene/paths/kinds.h"

namespace catoptric::scene {
namespace {

using config::Field;
using config::FieldType;
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
          {.name = "center",
           .type = FieldType::Vec3,
           .help = "The point in the middle, in metres.",
           .required = true},
          {.name = "radius",
           .type = FieldType::Number,
           .help = "The radius in metres.",
           .required = true,
           .minimum = 0.001},
          {.name = "height",
           .type = FieldType::Number,
           .help = "How high above the centre the camera is, in metres.",
           .defaultText = "0"},
          {.name = "turns",
           .type = FieldType::Number,
           .help = "How often it goes around; a negative number goes clockwise.",
           .defaultText = "1"},
          {.name = "start",
           .type = FieldType::Number,
           .help = "Where it begins, in degrees: 0 sees the centre from +z, 90 from +x.",
           .defaultText = "0"},
          {.name = "target",
           .type = FieldType::Vec3,
           .help = "The point at which the camera looks, in metres; without it the centre."},
          {.name = "radius_end",
           .type = FieldType::Number,
           .help = "The radius at the end, in metres.",
           .minimum = 0.001},
          {.name = "height_end",
           .type = FieldType::Number,
           .help = "The height at the end, in metres."},
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
