#include "trace/bake/emitters.h"

#include <algorithm>

#include "frame/shading.h"

namespace catoptric::trace {
namespace {

/// A triangle is bright if it reflects this many times the mean radiance of all surfaces; ours.
constexpr double kBright = 4.0;

/// The triangle whose vertices are the three `vertices`, with what it reflects.
Emitters::Triangle makeTriangle(const frame::Geometry& geometry, const std::vector<Vec3>& leaving,
                                const std::uint32_t* vertices) {
  Emitters::Triangle t;
  for (int k = 0; k < 3; ++k) {
    t.corners[k] = geometry.positions[vertices[k]];
    t.radiance[k] = leaving[vertices[k]];
  }
  const Vec3 across = glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
  t.normal = normalizedOr(across, Vec3(0.0f));
  t.area = 0.5f * glm::length(across);
  return t;
}

}  // namespace

Emitters::Pick Emitters::pick(double choice) const {
  const auto upper = std::upper_bound(cumulative.begin(), cumulative.end(), choice);
  const auto index = upper - cumulative.begin();
  const double lower = index > 0 ? *(upper - 1) : 0.0;
  return {.triangle = triangles[static_cast<std::size_t>(index)],
          .within = static_cast<float>((choice - lower) / (*upper - lower))};
}

Vec3 coarseTexel(const scene::Scene& scene, const scene::TextureSlot& slot,
                 const frame::VertexAttributes& vertex) {
  if (!slot.used()) return Vec3(1.0f);
  const scene::Texture& texture = scene.textures[slot.texture];
  const Vec2 uv = slot.transform * Vec3(slot.uvSet == 1 ? vertex.uv1 : vertex.uv0, 1.0f);
  const float lod = static_cast<float>(std::max<std::size_t>(texture.levels.size(), 4) - 4);
  return Vec3(frame::sampleTexture(texture, uv, lod));
}

Emitters findEmitters(const scene::Scene& scene, const frame::Geometry& geometry,
                      const std::vector<Vec3>& leaving) {
  Emitters emitters;
  emitters.ofTriangle.assign(geometry.triangleCount(), -1);
  double area = 0.0;
  double power = 0.0;  // of all surfaces
  for (const frame::ObjectRange& range : geometry.objects) {
    if (range.moving) continue;
    for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
      const Emitters::Triangle t = makeTriangle(geometry, leaving, &geometry.indices[i]);
      area += static_cast<double>(t.area);
      power += t.power();
    }
  }
  const double bright = area > 0.0 ? kBright * power / area : 0.0;
  for (std::size_t o = 0; o < geometry.objects.size(); ++o) {
    const scene::Material& material = scene.materials[scene.objects[o].material];
    const frame::ObjectRange& range = geometry.objects[o];
    const bool emissive = !material.unlit && luminance(material.emissive) > 0.0f;
    // Rays do not hit all of the triangles of others
    const bool whole = range.surface < 0 && material.alphaMode == scene::AlphaMode::Opaque;
    if (range.moving || !(emissive || whole)) continue;
    for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
      const std::uint32_t* vertices = &geometry.indices[i];
      Emitters::Triangle t = makeTriangle(geometry, leaving, vertices);
      if (!emissive && !(static_cast<double>(t.meanLuminance()) > bright)) continue;
      power -= t.power();
      Vec3 texels(0.0f);
      for (int k = 0; emissive && k < 3; ++k)
        texels += coarseTexel(scene, material.emissiveTexture, geometry.attributes[vertices[k]]);
      for (Vec3& radiance : t.radiance) radiance += material.emissive * texels / 3.0f;
      power += t.power();
      if (!(t.power() > 0.0)) continue;
      emitters.total += t.power();
      emitters.cumulative.push_back(emitters.total);
      emitters.ofTriangle[i / 3] = static_cast<std::int32_t>(emitters.triangles.size());
      emitters.triangles.push_back(t);
    }
  }
  for (double& c : emitters.cumulative) c /= emitters.total;
  emitters.share = power > 0.0 ? std::min(1.0, emitters.total / power) : 0.0;
  return emitters;
}

}  // namespace catoptric::trace
