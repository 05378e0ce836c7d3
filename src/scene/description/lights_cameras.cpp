// Lights, cameras, ambient light, baking and the environment of a described scene.
#include "core/nearest_file.h"
#include "core/text.h"
#include "scene/camera.h"
#include "scene/description/composer.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {

namespace {

/// A node's matrix at `position` that looks against `back`, with a level x; `back` closer to the
/// vertical than `leastSine` takes the world's x.
Mat4 levelFrame(const Vec3& position, const Vec3& back, float leastSine) {
  Vec3 right = glm::cross(Vec3(0.0f, 1.0f, 0.0f), back);
  if (glm::length(right) < leastSine) right = Vec3(1.0f, 0.0f, 0.0f);
  right = glm::normalize(right);
  return Mat4(Vec4(right, 0.0f), Vec4(glm::cross(back, right), 0.0f), Vec4(back, 0.0f),
              Vec4(position, 1.0f));
}

}  // namespace

using config::Value;

const std::vector<Handle>& Composer::handlesOf(const Value& name) const {
  const auto found = handles_.find(name.asString());
  if (found != handles_.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, handles] : handles_) names.push_back(known);
  name.fail("there is no object " + name.dump() + didYouMean(name.asString(), names));
}

void Composer::addLights(config::Errors& errors) {
  if (!root_.has("lights")) return;
  for (const Value& value : root_.get("lights").asArray()) errors.collect([&] { addLight(value); });
}

void Composer::addLight(const Value& value) {
  const auto get = [&](const char* name) { return config::valueOr(value, lightSchema(), name); };
  const auto number = [&](const char* name) { return static_cast<float>(get(name).asNumber()); };
  const std::string type = value.get("type").asString();
  Light light;
  light.name = value.has("name") ? value.get("name").asString() : type;
  light.type = type == "directional" ? LightType::Directional
               : type == "spot"      ? LightType::Spot
                                     : LightType::Point;
  if (type == "sphere" && !value.has("radius")) value.fail("a sphere light needs a \"radius\"");
  light.intensity = colorOf(get("color")) * number("intensity");
  light.range = number("range");
  light.innerConeRad = radians(number("inner_cone"));
  light.outerConeRad = radians(number("outer_cone"));
  if (light.type == LightType::Spot && light.innerConeRad >= light.outerConeRad) {
    value.fail("\"inner_cone\" must be smaller than \"outer_cone\"");
  }
  light.radius = number("radius");
  light.baked = get("baked").asBool();
  light.position = get("position").asVec3();
  Vec3 direction = get("direction").asVec3();
  if (value.has("target")) {
    if (value.has("direction")) value.fail("has both \"direction\" and \"target\"; remove one");
    direction = value.get("target").asVec3() - light.position;
  }
  if (!(glm::length(direction) > 1e-6f)) value.fail("the light's direction is the zero vector");
  light.direction = glm::normalize(direction);
  if (value.has("object")) {
    // Nodes shine along their -z.
    Node node;
    node.name = light.name;
    node.parent = handlesOf(value.get("object")).front().node;
    node.hasMatrix = true;
    node.matrix = levelFrame(light.position, -light.direction, 1e-4f);
    light.node = addNode(std::move(node), value);
  }
  if (light.baked && bakeMode() != "full") {
    value.get("baked").fail("a baked light needs \"bake\": {\"mode\": \"full\"} in the scene");
  }
  scene_.lights.push_back(std::move(light));
}

std::string Composer::bakeMode() const {
  return root_.has("bake") && root_.get("bake").has("mode")
             ? root_.get("bake").get("mode").asString()
             : std::string("none");
}

void Composer::addCameras(config::Errors& errors) {
  if (!root_.has("cameras")) return;
  // The description's own cameras come before its assets'.
  std::vector<CameraDefinition> own;
  for (const Value& value : root_.get("cameras").asArray())
    errors.collect([&] { own.push_back(cameraOf(value)); });
  scene_.cameras.insert(scene_.cameras.begin(), own.begin(), own.end());
}

CameraDefinition Composer::cameraOf(const Value& value) {
  const Vec3 position = value.get("position").asVec3();
  const Vec3 target = value.get("target").asVec3();
  if (!givesDirection(position, target)) value.fail("position and target are the same point");
  Node node;
  node.name = value.has("name") ? value.get("name").asString() : "camera";
  node.hasMatrix = true;
  node.matrix = levelFrame(position, glm::normalize(position - target), 1e-5f);
  CameraDefinition camera;
  camera.name = node.name;
  camera.node = addNode(std::move(node), value);
  camera.verticalFovRad =
      radians(value.has("fov") ? static_cast<float>(value.get("fov").asNumber()) : 60.0f);
  return camera;
}

void Composer::setSurroundings() {
  if (root_.has("ambient")) scene_.ambient = colorOf(root_.get("ambient"));
  if (root_.has("highlights")) scene_.highlights = root_.get("highlights").asBool();
  if (root_.has("bake")) {
    const Value bake = root_.get("bake");
    const std::string mode = bakeMode();
    scene_.bake.mode = mode == "full"   ? BakeMode::Full
                       : mode == "none" ? BakeMode::None
                                        : BakeMode::AmbientOcclusion;
    if (bake.has("rays")) scene_.bake.rays = static_cast<int>(bake.get("rays").asInteger());
    if (bake.has("bounces"))
      scene_.bake.bounces = static_cast<int>(bake.get("bounces").asInteger());
    if (bake.has("distance")) {
      scene_.bake.ambientOcclusionDistance = static_cast<float>(bake.get("distance").asNumber());
    }
  }
  setEnvironment();
}

void Composer::setEnvironment() {
  if (!root_.has("environment")) return;
  const Value value = root_.get("environment");
  const std::string type = value.get("type").asString();
  Environment& environment = scene_.environment;
  if (value.has("scale")) environment.scale = static_cast<float>(value.get("scale").asNumber());
  if (type == "constant") {
    environment.type = EnvironmentType::Constant;
    environment.color = colorOf(value.get("color"));
  } else if (type == "gradient") {
    environment.type = EnvironmentType::Gradient;
    environment.color = colorOf(value.get("zenith"));
    environment.horizon = colorOf(value.get("horizon"));
    environment.ground = colorOf(value.get("ground"));
  } else {
    environment.type = EnvironmentType::File;
    environment.file = describedFile(value.get("file"), file_.parent_path(), limits_);
    if (!std::filesystem::is_regular_file(environment.file)) {
      value.get("file").fail(noFileText(environment.file) + kAssetHint);
    }
    if (value.has("rotate")) {
      environment.rotationRad = radians(static_cast<float>(value.get("rotate").asNumber()));
    }
  }
}

}  // namespace catoptric::scene
