// Camera paths through a room.
#include <cmath>
#include <string>

#include "config/fields.h"
#include "scene/paths/curve.h"
#include "scene/paths/kinds.h"

namespace catoptric::scene {
namespace {

using config::FieldType;
namespace fields = config::fields;
using config::Schema;
using config::Value;

class WalkPath : public CommonPath {
 public:
  using CommonPath::CommonPath;

  PathFrame frame(int number) const override {
    const double s = common_.share(number, closed) * curve.length();
    const Vec3 eye = curve.at(s);
    Vec3 aim = target;
    if (look == Look::Targets) {
      aim = targets.at(s);
    } else if (look == Look::Ahead) {
      // Beyond the end of an open walk the last direction goes on.
      Vec3 ahead = curve.at(s + lookAhead);
      const double beyond = s + lookAhead - curve.length();
      if (!closed && beyond > 0.0) {
        ahead =
            curve.at(curve.length()) + static_cast<float>(beyond) * curve.tangent(curve.length());
      }
      const Vec3 direction = normalizedOr(ahead - eye, Vec3(0.0f, 0.0f, -1.0f));
      aim = eye + direction + std::tan(pitchRad) * Vec3(0.0f, 1.0f, 0.0f);
    }
    return common_.lookingAt(number, eye, aim, common_.fovRad);
  }

  enum class Look { Ahead, Target, Targets };
  ArcLengthCurve curve;
  TimedCurve targets;  ///< its "time" is the walk's arc length
  Look look = Look::Ahead;
  double lookAhead = 1.0;
  float pitchRad = 0.0f;
  Vec3 target{0.0f};
  bool closed = false;
};

}  // namespace

const Schema& walkSchema() {
  static const Schema schema{
      "walk",
      "A walk through points at constant speed.",
      {
          fields::required(fields::arrayOf("points",
                                           "Points [x, z] on the floor, or [x, y, z], in metres.",
                                           FieldType::Numbers, 2.0)),
          fields::number("eye_height", "The height of the eye above points [x, z], in metres.",
                         "1.6"),
          fields::choice(
              "look",
              "Where the camera looks: along the path, at one point, or at one for each point.",
              "\"ahead\"", {"ahead", "target", "targets"}),
          fields::number("look_ahead", "How far along the path it looks ahead, in metres.", "1",
                         0.01),
          fields::number("pitch", "Degrees by which it looks upwards, where it looks ahead.", "0",
                         -89.0, 89.0),
          fields::vec3("target", "The point at which it looks, in metres."),
          fields::arrayOf("targets",
                          "The points at which it looks, one for each point of the path.",
                          FieldType::Vec3),
          fields::boolean("closed", "Whether the walk returns to its first point.", "false"),
      }};
  return schema;
}

std::unique_ptr<CameraPath> makeWalk(const Value& walk, const PathSettings& common) {
  config::require(walk, walkSchema());
  auto path = std::make_unique<WalkPath>(common);
  const auto get = [&](const char* name) { return config::valueOr(walk, walkSchema(), name); };
  const double eyeHeight = metresOf(get("eye_height"));
  std::vector<Vec3> points;
  for (const Value& point : walk.get("points").asArray()) {
    if (point.asArray().size() == 2) {
      point.asFloats(2);  // throws
      const std::vector<Value>& xz = point.asArray();
      points.emplace_back(glm::dvec3(metresOf(xz[0]), eyeHeight, metresOf(xz[1])) - common.origin);
    } else {
      points.push_back(common.position(point));
    }
  }
  path->closed = get("closed").asBool() && points.size() > 2;
  path->curve = ArcLengthCurve(points, path->closed);
  const std::vector<double>& lengths = path->curve.keyLengths();
  for (std::size_t i = 1; i < lengths.size(); ++i) {
    if (lengths[i] - lengths[i - 1] < 1e-9) {
      walk.get("points").fail("points " + std::to_string(i - 1) + " and " +
                              std::to_string(i % points.size()) + " are the same");
    }
  }
  path->lookAhead = get("look_ahead").asNumber();
  path->pitchRad = radians(static_cast<float>(get("pitch").asNumber()));
  const std::string look = get("look").asString();
  if (look == "target") {
    path->look = WalkPath::Look::Target;
    path->target = common.position(walk.get("target"));
  } else if (look == "targets") {
    path->look = WalkPath::Look::Targets;
    std::vector<Vec3> targets;
    for (const Value& target : walk.get("targets").asArray())
      targets.push_back(common.position(target));
    if (targets.size() != points.size()) {
      walk.get("targets").fail("there are " + std::to_string(targets.size()) + " targets for " +
                               std::to_string(points.size()) +
                               " points; there must be one for each point");
    }
    path->targets = TimedCurve(targets, lengths, path->closed);
  }
  return path;
}

}  // namespace catoptric::scene
