#include "frame/surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <random>

#include "core/test_vector_levels.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/texture.h"

namespace catoptric::frame {
namespace {

using test::SceneBuilder;

/// Triangles of random vertices, with materials that need every kind of texture and of wrapping.
class World {
 public:
  World() {
    SceneBuilder builder;
    for (int size : {64, 3}) addTexture(builder.scene(), size);
    for (int i = 0; i < 6; ++i) {
      const int m = builder.reflective(0.1f * static_cast<float>(i), 0.3f, vector(), vector());
      scene::Material& material = builder.scene().materials[m];
      material.emissive = vector();
      if (i == 1 || i == 2) material.baseColorTexture = slot(i - 1);
      if (i == 3) material.normalTexture = slot(3);
      if (i == 3) material.emissiveTexture = slot(0);
      if (i == 4) material.metallicRoughnessTexture = slot(2);
      material.unlit = i == 5;
      builder.add(triangles(), m);
    }
    scene::Light light;
    light.position = {0.2f, 3.0f, 0.1f};
    light.intensity = Vec3(2.0f);
    builder.scene().lights.push_back(light);
    builder.scene().environment.type = scene::EnvironmentType::Gradient;
    builder.scene().environment.color = Vec3(0.2f, 0.4f, 0.9f);
    builder.scene().environment.ground = Vec3(0.3f, 0.2f, 0.1f);
    builder.scene().ambient = Vec3(0.4f);
    scene = builder.scene();
    const scene::Pose pose = scene::poseAt(scene, 0.0);
    geometry = makeGeometry(scene, pose);
    for (VertexAttributes& vertex : geometry.attributes)
      vertex.bake = Vec4(vector(), std::max(0.0f, uniform()));
    lighting = makeLighting(scene, pose, std::make_shared<EnvironmentLight>(scene.environment));
  }

  SurfaceLanes points(std::size_t count) {
    SurfaceLanes lanes;
    while (lanes.count < count) {
      const Vec2 at = 0.5f * (Vec2(uniform(), uniform()) + 1.0f);
      lanes.scatter[lanes.count] = at;
      lanes.add(static_cast<int>(random_() % scene.objects.size()),
                static_cast<std::uint32_t>(random_() % kTriangles), 0.5f * at.x, 0.5f * at.y,
                vector(), glm::normalize(vector() + Vec3(0.0f, 0.1f, 0.0f)),
                std::abs(uniform()) * (random_() % 8 == 0 ? 0.0f : 0.3f));
    }
    return lanes;
  }

  scene::Scene scene;
  Geometry geometry;
  Lighting lighting;

 private:
  static constexpr std::size_t kTriangles = 20;

  float uniform() { return std::uniform_real_distribution<float>(-1.0f, 1.0f)(random_); }
  Vec3 vector() { return {uniform(), uniform(), uniform()}; }

  /// One for each way to wrap and to filter, of noise.
  void addTexture(scene::Scene& to, int size) {
    using scene::Wrap;
    for (const Wrap wrap : {Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge}) {
      std::vector<std::uint8_t> noise(static_cast<std::size_t>(4 * size * size));
      for (std::uint8_t& texel : noise) texel = static_cast<std::uint8_t>(random_());
      scene::Texture& texture = to.textures.emplace_back();
      texture.srgb = wrap == Wrap::Repeat;
      texture.nearest = size == 3 && wrap == Wrap::ClampToEdge;
      texture.wrapS = wrap;
      texture.wrapT = size == 3 ? Wrap::Repeat : wrap;
      texture.levels = scene::makeMipChain(size, size, std::move(noise), texture.srgb);
    }
  }
  scene::TextureSlot slot(int texture) {
    return {texture, texture % 2,
            glm::mat3x2(1.0f + uniform(), uniform(), uniform(), 1.0f, uniform(), uniform())};
  }
  scene::Mesh triangles() {
    scene::Mesh mesh;
    for (std::size_t i = 0; i < 3 * kTriangles; ++i) {
      mesh.positions.push_back(2.0f * vector());
      mesh.normals.push_back(glm::normalize(vector()));
      mesh.tangents.emplace_back(glm::normalize(vector()), uniform() < 0.0f ? -1.0f : 1.0f);
      mesh.colors.push_back(glm::abs(vector()));
      for (auto& set : mesh.uv) set.emplace_back(3.0f * uniform(), 3.0f * uniform());
      mesh.indices.push_back(static_cast<std::uint32_t>(i));
    }
    return mesh;
  }

  std::mt19937 random_{7};
};

/// SurfacePoint::diffuse by the formula in shading.h, step by step.
Vec3 plainly(const World& world, const SurfaceLanes& lanes, std::size_t i) {
  const ObjectRange& range = world.geometry.objects[lanes.object[i]];
  const scene::Material& material =
      world.scene.materials[world.scene.objects[lanes.object[i]].material];
  const std::uint32_t* const t = &world.geometry.indices[range.firstIndex + 3 * lanes.primitive[i]];
  const auto at = [&]<class T>(T VertexAttributes::*member) {
    const auto& a = world.geometry.attributes;
    return (1.0f - lanes.u[i] - lanes.v[i]) * (a[t[0]].*member) + lanes.u[i] * (a[t[1]].*member) +
           lanes.v[i] * (a[t[2]].*member);
  };
  const Vec3 p0 = world.geometry.positions[t[0]];
  const Vec3 direction = lanes.direction.at(i);
  const Vec3 smooth = normalizedOr(at(&VertexAttributes::normal), Vec3(0.0f, 1.0f, 0.0f));
  const Vec3 across =
      glm::cross(world.geometry.positions[t[1]] - p0, world.geometry.positions[t[2]] - p0);
  const bool back = glm::dot(normalizedOr(across, smooth), direction) > 0.0f;
  const float facing = std::sqrt(std::max(std::abs(glm::dot(smooth, direction)), 0.05f));
  const auto sample = [&](const scene::TextureSlot& slot) {
    if (!slot.used()) return Vec3(1.0f);
    const Vec2 uv = slot.uvSet == 1 ? at(&VertexAttributes::uv1) : at(&VertexAttributes::uv0);
    const float footprint =
        range.uvPerMetre * textureScale(world.scene, slot) * lanes.coneWidth[i] / facing;
    return Vec3(sampleTexture(world.scene.textures[slot.texture], slot.transform * Vec3(uv, 1.0f),
                              std::log2(std::max(1e-8f, footprint))));
  };
  Vec3 normal = smooth;
  if (material.normalTexture.used()) {
    const Vec4 tangent = at(&VertexAttributes::tangent);
    const Vec3 x = normalizedOr(Vec3(tangent), Vec3(1.0f, 0.0f, 0.0f));
    const Vec3 m = 2.0f * sample(material.normalTexture) - Vec3(1.0f);
    const Vec3 y = glm::cross(smooth, x) * tangent.w;
    normal = normalizedOr(m.x * x + m.y * y + m.z * smooth, smooth);
  }
  if (back) normal = -normal;
  const Vec3 albedo =
      material.baseColor * sample(material.baseColorTexture) * at(&VertexAttributes::color);
  if (material.unlit) return albedo;
  const Vec4 bake = at(&VertexAttributes::bake);
  Vec3 irradiance(bake);
  if (bake.w > 0.0f)
    irradiance +=
        bake.w * (world.lighting.environment->irradiance(normal) + kPi * world.lighting.ambient);
  irradiance += lightIrradiance(world.lighting.lights.at(0), lanes.position.at(i), normal);
  return albedo * (1.0f / kPi) * irradiance + material.emissive * sample(material.emissiveTexture);
}

bool sameBits(const Vec3& a, const Vec3& b) {
  return std::bit_cast<std::array<std::uint32_t, 3>>(a) ==
         std::bit_cast<std::array<std::uint32_t, 3>>(b);
}

using Levels = VectorLevels;

TEST_P(Levels, GiveTheBitsOfTheFormula) {
  World world;
  for (std::size_t count = 1; count <= SurfaceLanes::kMost; count += count < 20 ? 1 : 11) {
    SurfaceLanes lanes = world.points(count);
    std::array<SurfacePoint, SurfaceLanes::kMost> surfaces;
    shadeSurfaces(world.scene, world.geometry, world.lighting, lanes, surfaces.data());
    SurfaceLanes diffuse = lanes;
    shadeSurfaces(world.scene, world.geometry, world.lighting, diffuse, nullptr);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 expected = plainly(world, lanes, i);
      ASSERT_TRUE(sameBits(lanes.diffuse.at(i), expected))
          << i << " of " << count << ", object " << lanes.object[i] << ": " << lanes.diffuse.at(i).x
          << " instead of " << expected.x;
      ASSERT_TRUE(sameBits(diffuse.diffuse.at(i), expected));
      const SurfacePoint alone =
          shadeSurface(world.scene, world.geometry, world.lighting, lanes.object[i],
                       lanes.primitive[i], lanes.u[i], lanes.v[i], lanes.position.at(i),
                       lanes.direction.at(i), lanes.coneWidth[i], lanes.scatter[i]);
      ASSERT_TRUE(sameBits(alone.diffuse, expected));
      ASSERT_TRUE(sameBits(alone.normal, surfaces[i].normal));
      ASSERT_TRUE(sameBits(alone.tint, surfaces[i].tint));
      ASSERT_EQ(alone.f90, surfaces[i].f90);
      ASSERT_EQ(alone.specularLevel, surfaces[i].specularLevel);
      ASSERT_EQ(alone.lobe.code, surfaces[i].lobe.code);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Levels,
                         testing::Values(VectorLevel::Base, VectorLevel::V2, VectorLevel::V3,
                                         VectorLevel::V4));

}  // namespace
}  // namespace catoptric::frame
