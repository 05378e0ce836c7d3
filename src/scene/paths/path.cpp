#include "scene/paths/path.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include "config/fields.h"
#include "core/error.h"
#include "core/text.h"
#include "scene/animate.h"
#include "scene/loader.h"
#include "scene/paths/kinds.h"
#include "scene/scene.h"

namespace catoptric::scene {
namespace {

using config::FieldType;
namespace fields = config::fields;
using config::Schema;
using config::Value;

/// A glTF camera, moving as its node is animated. The scene must outlive the path.
class SceneCameraPath : public CommonPath {
 public:
  SceneCameraPath(const PathSettings& common, const Scene& scene,
                  const CameraDefinition& definition, bool nearGiven)
      : CommonPath(common), scene_(scene), definition_(definition) {
    if (!nearGiven && definition.nearMetres > 0.0f) common_.nearMetres = definition.nearMetres;
  }

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
  FixedPath(const PathSettings& common, const Camera& camera)
      : CommonPath(common), camera_(camera) {}
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
  if (glm::length(up) < 1e-6f) value.fail("the direction is the zero vector");
  return glm::normalize(up);
}

std::unique_ptr<CameraPath> makeSceneCamera(const Value& name, const PathSettings& common,
                                            const Scene& scene, bool nearGiven) {
  std::vector<std::string> names;
  for (const CameraDefinition& camera : scene.cameras) {
    names.push_back(camera.name);
    if (name.asString().empty() || camera.name == name.asString()) {
      return std::make_unique<SceneCameraPath>(common, scene, camera, nearGiven);
    }
  }
  name.fail(names.empty()
                ? "the scene has no cameras"
                : "the scene has no camera \"" + name.asString() + "\"" +
                      didYouMean(name.asString(), names) + "; it has: " + joined(names, ", "));
}

PathSettings commonOf(const Value& path, const Scene& scene) {
  const auto get = [&](const char* name) { return config::valueOr(path, pathSchema(), name); };
  PathSettings common;
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
  const PathSettings common = commonOf(path, scene);

  if (kind == "keyframes") return makeKeyframes(path, common, framesGiven);
  if (kind == "orbit") return makeOrbit(path.get("orbit"), common);
  if (kind == "walk") return makeWalk(path.get("walk"), common);
  if (kind == "gltf_camera") {
    PathSettings timed = common;
    if (!framesGiven) {
      timed.frames = static_cast<int>(std::min<double>(
          kMaxPathFrames, std::floor(static_cast<double>(scene.duration()) * common.fps) + 1.0));
    }
    return makeSceneCamera(path.get("gltf_camera"), timed, scene, path.has("near"));
  }
  if (depth > 8) path.fail("segments are nested deeper than 8 levels");
  if (framesGiven)
    path.get("frames").fail(
        "\"frames\" is not allowed beside \"segments\"; give it in each segment");
  auto result = std::make_unique<SegmentedPath>();
  result->fps = common.fps;
  result->startTime = common.startTime;
  result->sceneTime = common.sceneTime;
  result->first.push_back(1);
  const Value segments = path.get("segments");
  if (segments.asArray().empty()) segments.fail("the list has no segment");
  for (const Value& segment : segments.asArray()) {
    result->parts.push_back(makePathAtDepth(segment, scene, depth + 1));
    const long long next =
        static_cast<long long>(result->first.back()) + result->parts.back()->count();
    if (next > kMaxPathFrames)
      segment.fail("the path has more than " + std::to_string(kMaxPathFrames) + " frames");
    result->first.push_back(static_cast<int>(next));
  }
  return result;
}

}  // namespace

double metresOf(const Value& value) {
  const double metres = value.asNumber();
  if (!(std::abs(metres) <= kMaxCoordinate)) {
    value.fail(value.dump() + " is too far: up to 1e9 metres are allowed");
  }
  return metres;
}

Vec3 PathSettings::position(const Value& value) const {
  value.asVec3();  // throws
  for (const Value& coordinate : value.asArray()) metresOf(coordinate);
  const std::vector<Value>& p = value.asArray();
  return Vec3(glm::dvec3(p[0].asNumber(), p[1].asNumber(), p[2].asNumber()) - origin);
}

PathFrame PathSettings::lookingAt(int number, const Vec3& eye, const Vec3& target,
                                  float fovOfFrame) const {
  if (!givesDirection(eye, target)) {
    throw UsageError(
        "camera path: in frame " + std::to_string(number) +
        " the camera and its target are at the same point, so the direction of view is undefined");
  }
  return frame(number, lookAt(eye, target, up, fovOfFrame));
}

const Schema& pathSchema() {
  static const Schema schema{
      "path",
      "A camera path: one of keyframes, orbit, walk, gltf_camera, segments.",
      {
          fields::text("$schema", "For editors; not read."),
          fields::text("name", "The path's name, for messages."),
          fields::any("comment", "Any text; not read."),
          fields::integer("frames",
                          "The number of frames; without it as many as the times ask for.", "1",
                          1.0, static_cast<double>(kMaxPathFrames)),
          fields::number("fps", "Frames per second of the scene's time.", "30", 0.001, 100000.0),
          fields::number("fov", "The vertical field of view in degrees.", "60", 0.001, 179.9),
          fields::number(
              "near",
              "The distance of the near plane in metres; there is no far plane. A gltf_camera "
              "has its file's (znear) unless this is given.",
              "0.01", 1e-9, 1e6),
          fields::vec3("up",
                       "The direction that is up in the image, where the camera looks at targets.",
                       "[0, 1, 0]"),
          fields::number("start_time", "The scene's time of the first frame, in seconds.", "0"),
          fields::boolean(
              "scene_time",
              "Whether the scene's animation runs with the frames; otherwise it stands at "
              "start_time.",
              "true"),
          fields::boolean(
              "constant_speed",
              "Of keyframes: whether the camera goes the same length from frame to frame.",
              "false"),
          fields::boolean("ease", "Whether the camera starts and ends gently.", "false"),
          fields::boolean("closed", "Of keyframes: whether the camera returns to the first.",
                          "false"),
          fields::arrayOf("keyframes", "A path that passes through all of these keys.",
                          keyframeSchema(), 1.0),
          fields::object("orbit", "A path around a point.", &orbitSchema()),
          fields::object("walk", "A walk through a room.", &walkSchema()),
          fields::text("gltf_camera",
                       "The name of a camera of the scene; an empty one takes the first."),
          fields::arrayOf("segments", "Paths that follow one another.", FieldType::Object),
      }};
  return schema;
}

std::unique_ptr<CameraPath> makePath(const Value& description, const Scene& scene) {
  return makePathAtDepth(description, scene, 0);
}

std::unique_ptr<CameraPath> loadPath(const std::filesystem::path& file, const Scene& scene) {
  return makePath(config::parseFile(file), scene);
}

namespace {

constexpr float kFitFovRad = radians(45.0f);

/// As long as the scene's animation.
PathSettings settingsFor(const Scene& scene) {
  PathSettings common;
  common.frames = std::clamp(
      static_cast<int>(std::floor(static_cast<double>(scene.duration()) * common.fps)) + 1, 1,
      kMaxPathFrames);
  common.origin = scene.origin;
  return common;
}

/// All vertices at time 0, and their mirror images in the ground, about the middle of their box.
struct Surround {
  std::vector<Vec3> places;
  Vec3 middle{0.0f};

  explicit Surround(const Scene& scene) {
    places = placesAtStart(scene);
    if (scene.ground != kNone) {
      const Object& ground = scene.objects[static_cast<std::size_t>(scene.ground)];
      const float level = scene.meshes[static_cast<std::size_t>(ground.mesh)].positions[0].y;
      const std::size_t images = ground.reflector > 0 ? places.size() : 0;
      for (std::size_t i = 0; i < images; ++i)
        places.emplace_back(places[i].x, 2.0f * level - places[i].y, places[i].z);
    }
    Box3 box;
    for (const Vec3& p : places) box.extend(p);
    middle = box.centre();
    for (Vec3& p : places) p -= middle;
  }

  /// How far from the middle a camera sees all, in an image that is at least as wide as high.
  /// `direction`: from the middle to the camera, unit length.
  float distanceFor(const Vec3& direction) const {
    constexpr float kMargin = 1.05f;  ///< ours
    const Mat3 axes(lookAt(direction, Vec3(0.0f), {0, 1, 0}, kFitFovRad).worldFromCamera);
    const float slope = 1.0f / std::tan(0.5f * kFitFovRad);
    float distance = 1e-3f;
    for (const Vec3& p : places) {
      const Vec3 q = p * axes;
      distance = std::max(distance, q.z + slope * std::max(std::abs(q.x), std::abs(q.y)));
    }
    return kMargin * distance;
  }
};

/// `direction`: from the scene to the camera.
std::unique_ptr<CameraPath> fitting(const Scene& scene, const Vec3& direction) {
  const Surround all(scene);
  const Vec3 towards = glm::normalize(direction);
  const float distance = all.distanceFor(towards);
  PathSettings common = settingsFor(scene);
  common.fovRad = kFitFovRad;
  common.nearMetres = std::min(0.01f, 0.01f * distance);
  return std::make_unique<FixedPath>(
      common, lookAt(all.middle + distance * towards, all.middle, common.up, common.fovRad));
}

std::unique_ptr<CameraPath> turntable(const Scene& scene, int frames) {
  constexpr int kDirections = 32;    ///< in which the scene must fit; ours
  constexpr float kHeight = 0.436f;  ///< sine of the angle above the horizon
  const Surround all(scene);
  const float across = std::sqrt(1.0f - kHeight * kHeight);
  float distance = 0.0f;
  for (int i = 0; i < kDirections; ++i) {
    const float turn = 2.0f * kPi * static_cast<float>(i) / kDirections;
    distance = std::max(
        distance, all.distanceFor({across * std::sin(turn), kHeight, across * std::cos(turn)}));
  }
  const glm::dvec3 centre = glm::dvec3(all.middle) + scene.origin;
  const Value path = config::parseText(
      fmt::format(R"({{"frames": {}, "fov": {}, "near": {},
                      "orbit": {{"center": [{}, {}, {}], "radius": {}, "height": {}}}}})",
                  frames, degrees(kFitFovRad), std::min(0.01f, 0.01f * distance), centre.x,
                  centre.y, centre.z, across * distance, kHeight * distance),
      "turntable");
  return makePath(path, scene);
}

/// EYE/TARGET[/FOV]. Throws UsageError where it is something else.
std::unique_ptr<CameraPath> looking(const std::string& text, const Scene& scene) {
  std::string numbers = text;
  for (std::size_t at = 0; (at = numbers.find('/', at)) != std::string::npos; at += 4)
    numbers.replace(at, 1, "], [");
  const Value parts = config::parseText("[[" + numbers + "]]", "camera");
  const std::vector<Value>& list = parts.asArray();
  PathSettings common = settingsFor(scene);
  common.fovRad = kFitFovRad;
  if (list.size() > 2) {
    const std::vector<Value>& last = list[2].asArray();
    const double fov = last.size() == 1 ? last[0].asNumber() : 0.0;
    if (list.size() > 3 || !(fov >= 0.001 && fov <= 179.9))
      throw UsageError("the field of view is one number from 0.001 to 179.9 degrees");
    common.fovRad = radians(static_cast<float>(fov));
  }
  const Vec3 eye = common.position(list.at(0));
  const Vec3 target = common.position(list.at(1));
  common.nearMetres = std::min(0.01f, 0.01f * glm::length(target - eye));
  return std::make_unique<FixedPath>(common,
                                     common.lookingAt(1, eye, target, common.fovRad).camera);
}

}  // namespace

std::unique_ptr<CameraPath> cameraPath(const std::string& text, const Scene& scene) {
  std::vector<std::string> names;
  for (const CameraDefinition& camera : scene.cameras) {
    if (text.empty() || camera.name == text)
      return std::make_unique<SceneCameraPath>(settingsFor(scene), scene, camera, false);
    if (!camera.name.empty()) names.push_back(camera.name);
  }
  if (text.empty() || text == "front") return fitting(scene, {0.0f, 0.25f, 1.0f});
  if (text == "three_quarter") return fitting(scene, {0.7f, 0.45f, 0.7f});
  constexpr std::string_view kTurntable = "turntable:";
  if (text.starts_with(kTurntable)) {
    int frames = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + kTurntable.size(), end, frames);
    if (error == std::errc() && rest == end && frames >= 1 && frames <= kMaxPathFrames)
      return turntable(scene, frames);
    throw UsageError("\"" + text + "\": turntable:N takes a number of frames from 1 to " +
                     std::to_string(kMaxPathFrames));
  }
  if (text.find('/') != std::string::npos &&
      text.find_first_not_of("0123456789.,+-eE/ ") == std::string::npos) {
    try {
      return looking(text, scene);
    } catch (const std::exception& error) {
      throw UsageError("\"" + text +
                       "\" is not EYE/TARGET/FOV, such as 2,1,3/0,0.5,0/45: " + error.what());
    }
  }
  for (const char* const kind : {"front", "three_quarter", "turntable:48"})
    if (std::ranges::find(names, kind) == names.end()) names.emplace_back(kind);
  throw UsageError("the scene has no camera \"" + text + "\"" + didYouMean(text, names) +
                   "; allowed: " + joined(names, ", ") + ", or EYE/TARGET/FOV");
}

}  // namespace catoptric::scene
