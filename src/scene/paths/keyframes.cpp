// Camera paths through keyframes.
#include <cmath>
#include <string>

#include "config/fields.h"
#include "scene/paths/curve.h"
#include "scene/paths/kinds.h"

namespace catoptric::scene {
namespace {

namespace fields = config::fields;
using config::Schema;
using config::Value;

class KeyframePath : public CommonPath {
 public:
  using CommonPath::CommonPath;

  PathFrame frame(int number) const override {
    const double u = common_.share(number, closed && wholeFrames);
    const double time = firstTime + (lastTime - firstTime) * u;
    const double positionTime = constantSpeed ? timeAtLength.at(u * positions.length()) : time;
    const Vec3 eye = constantSpeed ? positions.at(u * positions.length()) : timed.at(time);
    const auto fov = static_cast<float>(fovs.at(positionTime));
    if (hasTargets) {
      return common_.lookingAt(number, eye, targets.at(positionTime), fov);
    }
    Camera camera;
    camera.verticalFovRad = fov;
    camera.worldFromCamera = glm::mat4_cast(orientations.at(positionTime));
    camera.worldFromCamera[3] = Vec4(eye, 1.0f);
    return common_.frame(number, camera);
  }

  ArcLengthCurve positions;
  TimedCurve timed;
  TimedCurve targets;
  TimedRotation orientations;
  MonotoneCubic fovs;
  MonotoneCubic timeAtLength;  ///< constant speed: the keys' time by arc length
  bool hasTargets = true;
  bool constantSpeed = false;
  bool closed = false;
  bool wholeFrames = true;  ///< the number of frames was given
  double firstTime = 0.0;
  double lastTime = 0.0;
};

/// The keys, in the order of the file.
struct Keys {
  std::vector<Vec3> positions;
  std::vector<Vec3> targets;
  std::vector<Quat> orientations;
  std::vector<double> times;
  std::vector<double> fovs;
  bool timed = false;
  bool hasTargets = false;
  bool closed = false;  ///< with the way back to the first key in times, fovs and orientations
};

Keys readKeys(const Value& path, const PathSettings& common) {
  const std::vector<Value>& list = path.get("keyframes").asArray();
  if (list.empty()) path.get("keyframes").fail("a path needs at least one keyframe");
  Keys keys;
  keys.timed = list.front().has("time");
  keys.hasTargets = list.front().has("target");
  keys.closed = path.has("closed") && path.get("closed").asBool() && list.size() > 2;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Value& key = list[i];
    config::require(key, keyframeSchema());
    keys.positions.push_back(common.position(key.get("position")));
    if (key.has("target") == key.has("orientation")) {
      key.fail("a keyframe must have one of \"target\" and \"orientation\"");
    }
    if (key.has("target") != keys.hasTargets) {
      key.fail("all keyframes of a path have \"target\", or all have \"orientation\"");
    }
    if (keys.hasTargets) {
      keys.targets.push_back(common.position(key.get("target")));
      if (!givesDirection(keys.positions.back(), keys.targets.back()))
        key.fail("position and target are the same point");
    } else {
      const std::vector<float> q = key.get("orientation").asFloats(4);
      const Quat quaternion(q[3], q[0], q[1], q[2]);
      if (!(glm::length(quaternion) > 1e-6f)) {
        key.get("orientation").fail("the quaternion is zero");
      }
      keys.orientations.push_back(glm::normalize(quaternion));
    }
    if (key.has("time") != keys.timed) key.fail("all keyframes have a \"time\", or none has");
    keys.times.push_back(keys.timed ? key.get("time").asNumber() : static_cast<double>(i));
    if (i > 0 && keys.times[i] <= keys.times[i - 1]) {
      key.get("time").fail("times must increase: " + key.get("time").dump() + " follows " +
                           list[i - 1].get("time").dump());
    }
    keys.fovs.push_back(key.has("fov") ? key.get("fov").asNumber() * std::numbers::pi / 180.0
                                       : static_cast<double>(common.fovRad));
  }
  if (keys.closed) {
    // The way back takes the mean time of the other spans.
    const double back =
        (keys.times.back() - keys.times.front()) / static_cast<double>(list.size() - 1);
    keys.times.push_back(keys.times.back() + back);
    keys.fovs.push_back(keys.fovs.front());
    if (!keys.hasTargets) keys.orientations.push_back(keys.orientations.front());
  }
  return keys;
}

}  // namespace

const config::Schema& keyframeSchema() {
  static const Schema schema{
      "keyframe",
      "One key of a path, with a target or an orientation.",
      {
          fields::number(
              "time", "The key's time in seconds; where no key has one, they are spaced evenly."),
          fields::required(fields::vec3("position", "Where the camera is, in metres.")),
          fields::vec3("target", "The point at which the camera looks, in metres."),
          fields::numbers("orientation", "A quaternion x, y, z, w; the camera looks along its -z."),
          fields::number("fov", "The vertical field of view in degrees; without it the path's.", "",
                         0.001, 179.9),
      }};
  return schema;
}

std::unique_ptr<CameraPath> makeKeyframes(const Value& path, PathSettings common,
                                          bool framesGiven) {
  const Keys keys = readKeys(path, common);
  if (!framesGiven && keys.timed) {
    const double frames = std::round((keys.times.back() - keys.times.front()) * common.fps) + 1.0;
    if (frames > kMaxPathFrames)
      path.fail("the path has more than " + std::to_string(kMaxPathFrames) + " frames");
    common.frames = static_cast<int>(frames);
  }

  auto result = std::make_unique<KeyframePath>(common);
  result->closed = keys.closed;
  result->wholeFrames = framesGiven || !keys.timed;
  result->hasTargets = keys.hasTargets;
  result->firstTime = keys.times.front();
  result->lastTime = keys.times.back();
  result->fovs = MonotoneCubic(keys.times, keys.fovs);
  result->positions = ArcLengthCurve(keys.positions, result->closed);
  result->timed = TimedCurve(keys.positions, keys.times, result->closed);
  result->constantSpeed = path.has("constant_speed") && path.get("constant_speed").asBool();
  if (result->constantSpeed) {
    const std::vector<double>& lengths = result->positions.keyLengths();
    for (std::size_t i = 1; i < lengths.size(); ++i) {
      if (lengths[i] - lengths[i - 1] < 1e-9) {
        path.get("constant_speed")
            .fail(
                "two successive keyframes have the same position, but the camera cannot rest with "
                "a constant speed; remove one of them");
      }
    }
    result->timeAtLength = MonotoneCubic(lengths, keys.times);
  }
  if (keys.hasTargets) {
    result->targets = TimedCurve(keys.targets, keys.times, result->closed);
  } else {
    result->orientations = TimedRotation(keys.orientations, keys.times);
  }
  return result;
}

}  // namespace catoptric::scene
