#include "methods/second_order/reflectors.h"

#include <algorithm>

namespace catoptric::methods::second_order {

SceneReflectors findSceneReflectors(const scene::Scene& scene, const RunSettings& settings) {
  SceneReflectors found;
  static_cast<Reflectors&>(found) = findReflectors(scene, settings.reflectors);
  found.kinds.push_back(ReflectorKind::None);
  found.skipOwn.push_back(false);
  found.weight.push_back(1.0f);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Material& material = scene.materials[object.material];
    const raster::SampleClass kind = found.classOf[i + 1];
    const bool reflects = kind != raster::SampleClass::Diffuse;
    found.kinds.push_back(!reflects                             ? ReflectorKind::None
                          : kind == raster::SampleClass::Glossy ? ReflectorKind::Glossy
                                                                : ReflectorKind::Mirror);
    found.skipOwn.push_back(object.planar);
    const Vec3 tint = material.tintVaries() ? Vec3(1.0f) : material.reflectionTint;
    const bool varies = settings.fresnelSchlick || material.lobe == scene::LobeModel::Ggx ||
                        material.metallicRoughnessTexture.used();
    found.weight.push_back((varies ? 1.0f : material.specularLevel) *
                           std::max({tint.x, tint.y, tint.z}));
    found.levelsVary = found.levelsVary || (reflects && material.metallicRoughnessTexture.used());
  }
  return found;
}

std::vector<float> SceneReflectors::reach(const scene::Scene& scene, float glossyReach) const {
  std::vector<float> reach(kinds.size(), 0.0f);
  for (std::size_t i = 1; i < reach.size(); ++i) {
    const scene::Material& material = scene.materials[scene.objects[i - 1].material];
    if (kinds[i] == ReflectorKind::Glossy && !material.metallicRoughnessTexture.used()) {
      reach[i] = glossyReach * (1.0f - material.roughness) / material.roughness;
    }
  }
  return reach;
}

}  // namespace catoptric::methods::second_order
