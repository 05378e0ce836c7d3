#include "scene/scene.h"

#include <algorithm>

namespace catoptric::scene {
namespace {

template <class T>
std::size_t bytesOf(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

std::size_t trianglesOf(const Scene& scene, const Object& object) {
  return scene.meshes[static_cast<std::size_t>(object.mesh)].indices.size() / 3;
}

}  // namespace

int Scene::reflectorCount() const {
  int count = 0;
  for (const Object& object : objects) count = std::max(count, object.reflector);
  return count;
}

bool Scene::hasGgxLobes() const {
  return std::any_of(objects.begin(), objects.end(), [&](const Object& object) {
    const Material& material = materials[static_cast<std::size_t>(object.material)];
    return material.specularLevel > 0.0f && material.lobe == LobeModel::Ggx;
  });
}

std::size_t Scene::triangleCount() const {
  std::size_t count = 0;
  for (const Object& object : objects) count += trianglesOf(*this, object);
  return count;
}

std::size_t Scene::reflectiveTriangleCount() const {
  std::size_t count = 0;
  for (const Object& object : objects) {
    if (object.reflector > 0) count += trianglesOf(*this, object);
  }
  return count;
}

std::size_t Scene::memoryBytes() const {
  std::size_t bytes = bytesOf(meshes) + bytesOf(materials) + bytesOf(textures) + bytesOf(nodes) +
                      bytesOf(skins) + bytesOf(objects) + bytesOf(lights) + bytesOf(cameras) +
                      bytesOf(animation);
  for (const Mesh& mesh : meshes) {
    bytes += bytesOf(mesh.positions) + bytesOf(mesh.normals) + bytesOf(mesh.tangents) +
             bytesOf(mesh.uv[0]) + bytesOf(mesh.uv[1]) + bytesOf(mesh.colors) +
             bytesOf(mesh.joints) + bytesOf(mesh.weights) + bytesOf(mesh.indices) +
             bytesOf(mesh.morphTargets);
    for (const MorphTarget& target : mesh.morphTargets) {
      bytes += bytesOf(target.positions) + bytesOf(target.normals) + bytesOf(target.tangents);
    }
  }
  for (const Texture& texture : textures) {
    for (const MipLevel& level : texture.levels) bytes += bytesOf(level.rgba);
  }
  for (const Node& node : nodes) bytes += bytesOf(node.morphWeights);
  for (const Skin& skin : skins) bytes += bytesOf(skin.joints) + bytesOf(skin.inverseBind);
  for (const AnimationChannel& channel : animation) {
    bytes += bytesOf(channel.times) + bytesOf(channel.values);
  }
  return bytes;
}

float Scene::duration() const {
  float end = 0.0f;
  for (const AnimationChannel& channel : animation) {
    if (!channel.times.empty()) end = std::max(end, channel.times.back());
  }
  return end;
}

}  // namespace catoptric::scene
