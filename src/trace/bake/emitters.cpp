#include "trace/bake/emitters.h"

#include <algorithm>

#include "frame/shading.h"

namespace catoptric::trace {

Vec3 coarseTexel(const scene::Scene& scene, const scene::TextureSlot& slot,
                 const frame::VertexAttributes& vertex) {
  if (!slot.used()) return Vec3(1.0f);
  const scene::Texture& texture = scene.textures[slot.texture];
  const Vec2 uv = slot.transform * Vec3(slot.uvSet == 1 ? vertex.uv1 : vertex.uv0, 1.0f);
  const float lod = static_cast<float>(std::max<std::size_t>(texture.levels.size(), 4) - 4);
  return Vec3(frame::sampleTexture(texture, uv, lod));
}

Emitters findEmitters(const scene::Scene& scene, const frame::Geometry& geometry) {
  Emitters emitters;
  emitters.firstOfObject.assign(geometry.objects.size(), -1);
  for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
    const scene::Material& material = scene.materials[scene.objects[o].material];
    const frame::ObjectRange& range = geometry.objects[o];
    if (range.moving || material.unlit || !(luminance(material.emissive) > 0.0f)) continue;
    emitters.firstOfObject[o] = static_cast<std::int64_t>(emitters.triangles.size());
    for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
      Emitters::Triangle t;
      Vec3 texels(0.0f);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = geometry.indices[i + k];
        t.corners[k] = geometry.positions[vertex];
        texels += coarseTexel(scene, material.emissiveTexture, geometry.attributes[vertex]) / 3.0f;
      }
      const Vec3 across = glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
      t.normal = normalizedOr(across, Vec3(0.0f));
      t.radiance = material.emissive * texels;
      const float area = 0.5f * glm::length(across);
      emitters.total += static_cast<double>(luminance(t.radiance) * area);
      emitters.cumulative.push_back(static_cast<float>(emitters.total));
      emitters.triangles.push_back(t);
    }
  }
  for (float& c : emitters.cumulative) {
    c = static_cast<float>(static_cast<double>(c) / std::max(emitters.total, 1e-30));
  }
  return emitters;
}

}  // namespace catoptric::trace
