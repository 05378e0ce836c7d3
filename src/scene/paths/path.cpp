#include "scene/paths/path.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "core/text.h"
#include "scene/animate.h"
#include "scene/loader.h"
#include "scene/paths/curve.h"
#include "scene/scene.h"

namespace catoptric::scene {
namespace {

using config::Field;
using config::FieldType;
using config::Schema;
using config::Value;

constexpr int kMaxFrames = 1'000'000;

const Schema& keyframeSchema() {
  static const Schema schema{
      "keyframe",
      "one key of a path; give target or orientation",
      {
          {.name = "time",
           .type = FieldType::Number,
           .help = "seconds; left out in all: even spacing"},
          {.name = "position", .type = FieldType::Vec3, .help = "metres", .required = true},
          {.name = "target", .type = FieldType::Vec3, .help = "metres; what the camera looks at"},
          {.name = "orientation",
           .type = FieldType::Numbers,
           .help = "quaternion x, y, z, w; the camera looks along its -z"},
          {.name = "fov",
           .type = FieldType::Number,
           .help = "vertical field of view, degrees; default: the path's",
           .minimum = 0.001,
           .maximum = 179.9},
      }};
  return schema;
}

const Schema& orbitSchema() {
  static const Schema schema{
      "orbit",
      "a circle or spiral around a point",
      {
          {.name = "center", .type = FieldType::Vec3, .help = "metres", .required = true},
          {.name = "radius",
           .type = FieldType::Number,
           .help = "metres",
           .required = true,
           .minimum = 0.001},
          {.name = "height",
           .type = FieldType::Number,
           .help = "metres above the centre",
           .defaultText = "0"},
          {.name = "turns",
           .type = FieldType::Number,
           .help = "negative: clockwise",
           .defaultText = "1"},
          {.name = "start",
           .type = FieldType::Number,
           .help = "degrees; 0: seen from +z, 90: from +x",
           .defaultText = "0"},
          {.name = "target", .type = FieldType::Vec3, .help = "metres; default: the centre"},
          {.name = "radius_end", .type = FieldType::Number, .help = "metres", .minimum = 0.001},
          {.name = "height_end", .type = FieldType::Number, .help = "metres"},
      }};
  return schema;
}

const Schema& walkSchema() {
  static const Schema schema{"walk",
                             "a walk through points at constant speed",
                             {
                                 {.name = "points",
                                  .type = FieldType::Array,
                                  .help = "[x, z] on the floor, or [x, y, z]",
                                  .required = true,
                                  .minimum = 2.0,
                                  .items = FieldType::Numbers},
                                 {.name = "eye_height",
                                  .type = FieldType::Number,
                                  .help = "metres, for points [x, z]",
                                  .defaultText = "1.6"},
                                 {.name = "look",
                                  .type = FieldType::String,
                                  .help = "where to",
                                  .defaultText = "\"ahead\"",
                                  .allowed = {"ahead", "target", "targets"}},
                                 {.name = "look_ahead",
                                  .type = FieldType::Number,
                                  .help = "metres along the path",
                                  .defaultText = "1",
                                  .minimum = 0.01},
                                 {.name = "pitch",
                                  .type = FieldType::Number,
                                  .help = "degrees upwards, for ahead",
                                  .defaultText = "0",
                                  .minimum = -89.0,
                                  .maximum = 89.0},
                                 {.name = "target", .type = FieldType::Vec3, .help = "metres"},
                                 {.name = "targets",
                                  .type = FieldType::Array,
                                  .help = "one per point",
                                  .items = FieldType::Vec3},
                                 {.name = "closed",
                                  .type = FieldType::Bool,
                                  .help = "returns to its first point",
                                  .defaultText = "false"},
                             }};
  return schema;
}

/// A coordinate or length. Throws UsageError beyond kMaxCoordinate.
double metresOf(const Value& value) {
  const double metres = value.asNumber();
  if (!(std::abs(metres) <= kMaxCoordinate)) {
    value.fail(value.dump() + " is too far: up to 1e9 metres are allowed");
  }
  return metres;
}

/// What all kinds of paths share.
struct Common {
  int frames = 1;
  double fps = 30.0;
  double startTime = 0.0;
  bool sceneTime = true;
  bool ease = false;
  float fovRad = radians(60.0f);
  float nearMetres = 0.01f;
  Vec3 up{0.0f, 1.0f, 0.0f};
  glm::dvec3 origin{0.0};  ///< of the scene's world space

  /// A position of the file in world space.
  Vec3 position(const Value& value) const {
    value.asVec3();  // throws
    for (const Value& coordinate : value.asArray()) metresOf(coordinate);
    const std::vector<Value>& p = value.asArray();
    return Vec3(glm::dvec3(p[0].asNumber(), p[1].asNumber(), p[2].asNumber()) - origin);
  }

  /// Share of the way of frame `number`: 0 at the first, 1 at the last; a loop's last frame stops
  /// one step before its first.
  double share(int number, bool loop) const {
    const int steps = loop ? frames : frames - 1;
    const double u = steps > 0 ? static_cast<double>(number - 1) / steps : 0.0;
    return ease ? u * u * u * (u * (6.0 * u - 15.0) + 10.0) : u;
  }
  double timeOf(int number) const {
    return sceneTime ? startTime + static_cast<double>(number - 1) / fps : startTime;
  }
  PathFrame frame(int number, Camera camera) const {
    camera.nearMetres = nearMetres;
    return {number, timeOf(number), camera};
  }
};

class CommonPath : public CameraPath {
 public:
  explicit CommonPath(const Common& common) : common_(common) {}
  int count() const override { return common_.frames; }

 protected:
  Common common_;
};

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
      return common_.frame(number, lookAt(eye, targets.at(positionTime), common_.up, fov));
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
    return common_.frame(number, lookAt(centre + offset, target, common_.up, common_.fovRad));
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
    return common_.frame(number, lookAt(eye, aim, common_.up, common_.fovRad));
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

/// A glTF camera, moving as its node is animated. The scene must outlive the path.
class SceneCameraPath : public CommonPath {
 public:
  SceneCameraPath(const Common& common, const Scene& scene, const CameraDefinition& definition)
      : CommonPath(common), scene_(scene), definition_(definition) {}

  PathFrame frame(int number) const override {
    Camera camera;
    camera.verticalFovRad = definition_.verticalFovRad;
    if (definition_.node != kNone) {
      const Pose pose = poseAt(scene_, common_.timeOf(number));
      const Mat4& m = pose.worldFromNode[static_cast<std::size_t>(definition_.node)];
      // Scale in the hierarchy does not scale a camera: only its axes' directions count.
      const Vec3 back = normalizedOr(Vec3(m[2]), Vec3(0.0f, 0.0f, 1.0f));
      camera = lookAt(Vec3(m[3]), Vec3(m[3]) - back, Vec3(m[1]), definition_.verticalFovRad);
    }
    return common_.frame(number, camera);
  }

 private:
  const Scene& scene_;
  CameraDefinition definition_;
};

class FixedPath : public CommonPath {
 public:
  FixedPath(const Common& common, const Camera& camera) : CommonPath(common), camera_(camera) {}
  PathFrame frame(int number) const override { return common_.frame(number, camera_); }

 private:
  Camera camera_;
};

class SegmentedPath : public CameraPath {
 public:
  int count() const override { return first.back() - 1; }
  PathFrame frame(int number) const override {
    std::size_t s = 0;
    while (s + 1 < parts.size() && number >= first[s + 1]) ++s;
    PathFrame frame = parts[s]->frame(number - first[s] + 1);
    frame.number = number;
    frame.timeSeconds = startTime + (sceneTime ? static_cast<double>(number - 1) / fps : 0.0);
    return frame;
  }

  std::vector<std::unique_ptr<CameraPath>> parts;
  std::vector<int> first;  ///< first frame of each part, and one past the last
  double fps = 30.0;
  double startTime = 0.0;
  bool sceneTime = true;
};

Vec3 unitUp(const Value& value) {
  const Vec3 up = value.asVec3();
  if (glm::length(up) < 1e-6f) value.fail("the direction has no length");
  return glm::normalize(up);
}

std::unique_ptr<CameraPath> makeKeyframes(const Value& path, Common common, bool framesGiven) {
  const std::vector<Value>& keys = path.get("keyframes").asArray();
  if (keys.empty()) path.get("keyframes").fail("a path needs at least one keyframe");
  const bool timed = keys.front().has("time");
  const bool hasTargets = keys.front().has("target");
  const bool closed = path.has("closed") && path.get("closed").asBool();

  std::vector<Vec3> positions;
  std::vector<Vec3> targets;
  std::vector<Quat> orientations;
  std::vector<double> times;
  std::vector<double> fovs;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Value& key = keys[i];
    config::require(key, keyframeSchema());
    positions.push_back(common.position(key.get("position")));
    if (key.has("target") == key.has("orientation")) {
      key.fail("a keyframe has either \"target\" or \"orientation\"");
    }
    if (key.has("target") != hasTargets) {
      key.fail("all keyframes of a path have \"target\", or all have \"orientation\"");
    }
    if (hasTargets) {
      targets.push_back(common.position(key.get("target")));
      if (targets.back() == positions.back()) key.fail("position and target are the same point");
    } else {
      const std::vector<float> q = key.get("orientation").asFloats(4);
      const Quat quaternion(q[3], q[0], q[1], q[2]);
      if (!(glm::length(quaternion) > 1e-6f)) {
        key.get("orientation").fail("the quaternion has no length");
      }
      orientations.push_back(glm::normalize(quaternion));
    }
    if (key.has("time") != timed) key.fail("all keyframes have a \"time\", or none has");
    times.push_back(timed ? key.get("time").asNumber() : static_cast<double>(i));
    if (i > 0 && times[i] <= times[i - 1]) {
      key.get("time").fail("times must increase: " + key.get("time").dump() + " follows " +
                           keys[i - 1].get("time").dump());
    }
    fovs.push_back(key.has("fov") ? key.get("fov").asNumber() * std::numbers::pi / 180.0
                                  : static_cast<double>(common.fovRad));
  }
  if (closed && keys.size() > 2) {
    // The way back takes the mean time of the other spans.
    const double back = (times.back() - times.front()) / static_cast<double>(keys.size() - 1);
    times.push_back(times.back() + back);
    fovs.push_back(fovs.front());
    if (!hasTargets) orientations.push_back(orientations.front());
  }
  if (!framesGiven && timed) {
    const double frames = std::round((times.back() - times.front()) * common.fps) + 1.0;
    if (frames > kMaxFrames)
      path.fail("the path has more than " + std::to_string(kMaxFrames) + " frames");
    common.frames = static_cast<int>(frames);
  }

  auto result = std::make_unique<KeyframePath>(common);
  result->closed = closed && keys.size() > 2;
  result->wholeFrames = framesGiven || !timed;
  result->hasTargets = hasTargets;
  result->firstTime = times.front();
  result->lastTime = times.back();
  result->fovs = MonotoneCubic(times, fovs);
  result->positions = ArcLengthCurve(positions, result->closed);
  result->timed = TimedCurve(positions, times, result->closed);
  result->constantSpeed = path.has("constant_speed") && path.get("constant_speed").asBool();
  if (result->constantSpeed) {
    const std::vector<double>& lengths = result->positions.keyLengths();
    for (std::size_t i = 1; i < lengths.size(); ++i) {
      if (lengths[i] - lengths[i - 1] < 1e-9) {
        path.get("constant_speed")
            .fail(
                "two successive keyframes have the same position; with a constant speed the "
                "camera cannot rest there");
      }
    }
    result->timeAtLength = MonotoneCubic(lengths, times);
  }
  if (hasTargets) {
    result->targets = TimedCurve(targets, times, result->closed);
  } else {
    result->orientations = TimedRotation(orientations, times);
  }
  return result;
}

std::unique_ptr<CameraPath> makeOrbit(const Value& orbit, const Common& common) {
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

std::unique_ptr<CameraPath> makeWalk(const Value& walk, const Common& common) {
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
                               std::to_string(points.size()) + " points; one per point is wanted");
    }
    path->targets = TimedCurve(targets, lengths, path->closed);
  }
  return path;
}

std::unique_ptr<CameraPath> makeSceneCamera(const Value& name, const Common& common,
                                            const Scene& scene) {
  std::vector<std::string> names;
  for (const CameraDefinition& camera : scene.cameras) {
    names.push_back(camera.name);
    if (name.asString().empty() || camera.name == name.asString()) {
      return std::make_unique<SceneCameraPath>(common, scene, camera);
    }
  }
  name.fail(names.empty()
                ? "the scene has no cameras"
                : "the scene has no camera \"" + name.asString() + "\"" +
                      didYouMean(name.asString(), names) + "; it has: " + joined(names, ", "));
}

Common commonOf(const Value& path, const Scene& scene) {
  const auto get = [&](const char* name) { return config::valueOr(path, pathSchema(), name); };
  Common common;
  common.fps = get("fps").asNumber();
  common.frames = static_cast<int>(get("frames").asInteger());
  common.startTime = get("start_time").asNumber();
  common.sceneTime = get("scene_time").asBool();
  common.ease = get("ease").asBool();
  common.fovRad = radians(static_cast<float>(get("fov").asNumber()));
  common.nearMetres = static_cast<float>(get("near").asNumber());
  common.up = unitUp(get("up"));
  common.origin = scene.origin;
  return common;
}

std::unique_ptr<CameraPath> makePathAtDepth(const Value& path, const Scene& scene, int depth) {
  config::require(path, pathSchema());
  const std::vector<std::string> kinds{"keyframes", "orbit", "walk", "gltf_camera", "segments"};
  std::string kind;
  for (const std::string& candidate : kinds) {
    if (!path.has(candidate)) continue;
    if (!kind.empty()) {
      path.fail("a path has one of " + joined(kinds, ", ") + ", not both \"" + kind + "\" and \"" +
                candidate + "\"");
    }
    kind = candidate;
  }
  if (kind.empty()) path.fail("a path needs one of " + joined(kinds, ", "));
  const bool framesGiven = path.has("frames");
  const Common common = commonOf(path, scene);

  if (kind == "keyframes") return makeKeyframes(path, common, framesGiven);
  if (kind == "orbit") return makeOrbit(path.get("orbit"), common);
  if (kind == "walk") return makeWalk(path.get("walk"), common);
  if (kind == "gltf_camera") {
    Common timed = common;
    if (!framesGiven) {
      timed.frames = static_cast<int>(std::min<double>(
          kMaxFrames, std::floor(static_cast<double>(scene.duration()) * common.fps) + 1.0));
    }
    return makeSceneCamera(path.get("gltf_camera"), timed, scene);
  }
  if (depth > 8) path.fail("segments are nested too deeply");
  if (framesGiven) path.get("frames").fail("segments have their own \"frames\"");
  auto result = std::make_unique<SegmentedPath>();
  result->fps = common.fps;
  result->startTime = common.startTime;
  result->sceneTime = common.sceneTime;
  result->first.push_back(1);
  const Value segments = path.get("segments");
  if (segments.asArray().empty()) segments.fail("there are no segments");
  for (const Value& segment : segments.asArray()) {
    result->parts.push_back(makePathAtDepth(segment, scene, depth + 1));
    const long long next =
        static_cast<long long>(result->first.back()) + result->parts.back()->count();
    if (next > kMaxFrames)
      segment.fail("the path has more than " + std::to_string(kMaxFrames) + " frames");
    result->first.push_back(static_cast<int>(next));
  }
  return result;
}

}  // namespace

const Schema& pathSchema() {
  static const Schema schema{
      "path",
      "A camera path: one of keyframes, orbit, walk, gltf_camera, segments.",
      {
          {.name = "name", .type = FieldType::String, .help = "for messages"},
          {.name = "comment", .type = FieldType::Any, .help = "any text"},
          {.name = "frames",
           .type = FieldType::Integer,
           .help = "number of frames; default: as many as the times ask for",
           .defaultText = "1",
           .minimum = 1.0,
           .maximum = static_cast<double>(kMaxFrames)},
          {.name = "fps",
           .type = FieldType::Number,
           .help = "frames per second of the scene's time",
           .defaultText = "30",
           .minimum = 0.001,
           .maximum = 100000.0},
          {.name = "fov",
           .type = FieldType::Number,
           .help = "vertical field of view, degrees",
           .defaultText = "60",
           .minimum = 0.001,
           .maximum = 179.9},
          {.name = "near",
           .type = FieldType::Number,
           .help = "near plane, metres; there is no far plane",
           .defaultText = "0.01",
           .minimum = 1e-9,
           .maximum = 1e6},
          {.name = "up",
           .type = FieldType::Vec3,
           .help = "what is up in the image, for targets",
           .defaultText = "[0, 1, 0]"},
          {.name = "start_time",
           .type = FieldType::Number,
           .help = "the scene's time of the first frame, seconds",
           .defaultText = "0"},
          {.name = "scene_time",
           .type = FieldType::Bool,
           .help = "the scene's animation runs with the frames; false: it stands at start_time",
           .defaultText = "true"},
          {.name = "constant_speed",
           .type = FieldType::Bool,
           .help = "keyframes: equal arc length from frame to frame",
           .defaultText = "false"},
          {.name = "ease",
           .type = FieldType::Bool,
           .help = "starts and ends gently",
           .defaultText = "false"},
          {.name = "closed",
           .type = FieldType::Bool,
           .help = "keyframes: returns to the first",
           .defaultText = "false"},
          {.name = "keyframes",
           .type = FieldType::Array,
           .help = "passes through all keys",
           .minimum = 1.0,
           .object = &keyframeSchema()},
          {.name = "orbit",
           .type = FieldType::Object,
           .help = "around a point",
           .object = &orbitSchema()},
          {.name = "walk",
           .type = FieldType::Object,
           .help = "through a room",
           .object = &walkSchema()},
          {.name = "gltf_camera",
           .type = FieldType::String,
           .help = "a camera of the scene; empty: its first"},
          {.name = "segments",
           .type = FieldType::Array,
           .help = "paths that follow one another",
           .items = FieldType::Object},
      }};
  return schema;
}

std::unique_ptr<CameraPath> makePath(const Value& description, const Scene& scene) {
  return makePathAtDepth(description, scene, 0);
}

std::unique_ptr<CameraPath> loadPath(const std::filesystem::path& file, const Scene& scene) {
  return makePath(config::parseFile(file), scene);
}

std::unique_ptr<CameraPath> defaultPath(const Scene& scene) {
  Common common;
  common.frames = std::clamp(
      static_cast<int>(std::floor(static_cast<double>(scene.duration()) * common.fps)) + 1, 1,
      kMaxFrames);
  if (!scene.cameras.empty()) {
    return std::make_unique<SceneCameraPath>(common, scene, scene.cameras.front());
  }

  // No camera: from the front and a little above, so far away that the bounding sphere fits.
  const Pose pose = poseAt(scene, 0.0);
  Box3 bounds;
  for (const Object& object : scene.objects) {
    for (const Vec3& p : worldVertices(scene, object, pose).positions) bounds.extend(p);
  }
  const float radius = std::max(0.5f * bounds.diameter(), 1e-3f);
  common.fovRad = radians(45.0f);
  common.nearMetres = std::min(0.01f, 0.01f * radius);
  const float distance = radius / std::sin(0.5f * common.fovRad);
  const Vec3 direction = glm::normalize(Vec3(0.0f, 0.25f, 1.0f));
  return std::make_unique<FixedPath>(common, lookAt(bounds.centre() + distance * direction,
                                                    bounds.centre(), common.up, common.fovRad));
}

}  // namespace catoptric::scene
