// Small scenes built in code, for tests of several modules; they need no files and no loader.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/math.h"
#include "scene/reflectance.h"
#include "scene/scene.h"
#include "scene/shapes/shapes.h"

namespace catoptric::test {

/// Builds a scene object by object and sets the members that finishScene() would derive.
class SceneBuilder {
 public:
  SceneBuilder() { scene_.source = "test scene"; }

  int diffuse(const Vec3& color, const Vec3& emissive = Vec3(0.0f)) {
    scene::Material m;
    m.baseColor = color;
    m.emissive = emissive;
    scene_.materials.push_back(m);
    return static_cast<int>(scene_.materials.size()) - 1;
  }
  int reflective(float s, float g = 0.0f, const Vec3& color = Vec3(0.5f),
                 const Vec3& tint = Vec3(1.0f)) {
    scene::Material m;
    m.baseColor = color;
    m.specularLevel = s;
    m.roughness = g;
    m.reflectionTint = tint;
    scene_.materials.push_back(m);
    return static_cast<int>(scene_.materials.size()) - 1;
  }

  /// Adds a mesh under a new node; returns the object's index.
  int add(scene::Mesh mesh, int material, const Mat4& worldFromObject = Mat4(1.0f)) {
    scene::Node node;
    node.hasMatrix = true;
    node.matrix = worldFromObject;
    scene_.nodes.push_back(node);
    scene::Object object;
    object.name = "object" + std::to_string(scene_.objects.size());
    object.mesh = static_cast<int>(scene_.meshes.size());
    object.node = static_cast<int>(scene_.nodes.size()) - 1;
    object.material = material;
    if (scene_.materials[material].specularLevel >= scene::kReflectiveThreshold) {
      object.reflector = ++reflectors_;
      object.planar = isPlanar(mesh);
    }
    scene_.meshes.push_back(std::move(mesh));
    scene_.objects.push_back(object);
    return static_cast<int>(scene_.objects.size()) - 1;
  }

  /// Moves an object by `metresPerSecond` from time 0 to `seconds`.
  void move(int object, const Vec3& metresPerSecond, float seconds) {
    scene::Node& node = scene_.nodes[scene_.objects[object].node];
    node.hasMatrix = false;
    node.translation = Vec3(node.matrix[3]);
    const Vec3 from = node.translation;
    const Vec3 to = from + metresPerSecond * seconds;
    scene::AnimationChannel channel;
    channel.node = scene_.objects[object].node;
    channel.times = {0.0f, seconds};
    channel.values = {from.x, from.y, from.z, to.x, to.y, to.z};
    scene_.animation.push_back(channel);
  }

  /// Animates the uniform scale of an object about its node's origin. Keys are pairs of time and
  /// factor.
  void scaleUniformly(int object, const std::vector<Vec2>& keys) {
    scene::Node& node = scene_.nodes[scene_.objects[object].node];
    node.hasMatrix = false;
    node.translation = Vec3(node.matrix[3]);
    scene::AnimationChannel channel;
    channel.node = scene_.objects[object].node;
    channel.target = scene::Target::Scale;
    for (const Vec2& key : keys) {
      channel.times.push_back(key.x);
      channel.values.insert(channel.values.end(), 3, key.y);
    }
    scene_.animation.push_back(channel);
  }

  void constantEnvironment(const Vec3& radiance) {
    scene_.environment.type = scene::EnvironmentType::Constant;
    scene_.environment.color = radiance;
  }

  scene::Scene& scene() { return scene_; }

 private:
  static bool isPlanar(const scene::Mesh& mesh) {
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 n = mesh.normals[0];
      if (std::abs(glm::dot(n, mesh.positions[i] - mesh.positions[0])) > 1e-5f) return false;
      if (glm::dot(n, mesh.normals[i]) < 0.99999f) return false;
    }
    return true;
  }

  scene::Scene scene_;
  int reflectors_ = 0;
};

inline Mat4 translation(const Vec3& t) {
  return glm::translate(Mat4(1.0f), t);
}
inline Mat4 rotation(float degreesAngle, const Vec3& axis) {
  return glm::rotate(Mat4(1.0f), radians(degreesAngle), axis);
}

}  // namespace catoptric::test
