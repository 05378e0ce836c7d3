// Everything in a scene that can change a pixel changes its fingerprint, field by field.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <memory>
#include <vector>

#include "core/test_fields.h"
#include "scene/finish_steps.h"
#include "scene/implicit/surface.h"

namespace catoptric::scene {
namespace {

using test::expectAllCount;
using test::expectNoneCounts;

/// A scene with one of everything.
class SceneFingerprint : public ::testing::Test {
 protected:
  SceneFingerprint() {
    Mesh& mesh = scene_.meshes.emplace_back();
    mesh.positions = mesh.normals = mesh.colors = {Vec3(1.0f)};
    mesh.tangents = mesh.weights = {Vec4(1.0f)};
    mesh.uv = {std::vector<Vec2>{Vec2(0.0f)}, std::vector<Vec2>{Vec2(0.0f)}};
    mesh.joints.emplace_back(0, 0, 0, 0);
    mesh.indices = {0};
    mesh.surface = surface_;
    MorphTarget& target = mesh.morphTargets.emplace_back();
    target.positions = target.normals = target.tangents = {Vec3(0.0f)};
    scene_.materials.emplace_back();
    scene_.textures.emplace_back().levels = {{1, 1, {0, 0, 0, 255}}};
    scene_.nodes.emplace_back().morphWeights = {0.0f};
    scene_.skins.push_back({{0}, {Mat4(1.0f)}});
    scene_.objects.emplace_back();
    scene_.lights.emplace_back();
    scene_.cameras.emplace_back();
    AnimationChannel& channel = scene_.animation.emplace_back();
    channel.times = channel.values = {0.0f};
    scene_.notes = scene_.warnings = {"something"};
  }

  std::shared_ptr<implicit::Surface> surface_ =
      std::make_shared<implicit::Surface>(implicit::sphereSurface(1.0));
  Scene scene_;
  std::function<std::uint64_t()> print_ = [this] { return fingerprintOf(scene_); };
};

TEST_F(SceneFingerprint, HasTheWholeOfTheScene) {
  auto& [name, source, origin, meshes, materials, textures, nodes, skins, objects, lights, cameras,
         groundObject, animation, environment, bake, ambient, highlights, notes, warnings,
         fingerprint] = scene_;
  expectAllCount(print_, origin, meshes, materials, textures, nodes, skins, objects, lights,
                 cameras, animation, ambient, highlights);
  expectNoneCounts(print_, name, source, groundObject, notes, warnings, fingerprint);

  auto& [mode, rays, bounces, ambientOcclusionDistance, skyApart] = bake;
  expectAllCount(print_, mode, rays, bounces, ambientOcclusionDistance, skyApart);

  auto& [type, color, horizon, ground, file, scale, rotationRad, isDefault] = environment;
  expectAllCount(print_, type, color, horizon, ground, scale, rotationRad);
  expectNoneCounts(print_, file, isDefault);
}

TEST_F(SceneFingerprint, HasTheContentsOfTheEnvironmentsFile) {
  scene_.environment.type = EnvironmentType::File;
  scene_.environment.file = ::testing::TempDir() + "fingerprint.hdr";
  std::ofstream(scene_.environment.file) << "one sky";
  const std::uint64_t one = print_();
  std::ofstream(scene_.environment.file) << "two sky";
  EXPECT_NE(print_(), one);
}

TEST_F(SceneFingerprint, HasTheWholeOfAMesh) {
  auto& [name, positions, normals, tangents, uv, colors, joints, weights, morphTargets, indices,
         surface] = scene_.meshes[0];
  expectAllCount(print_, positions, normals, tangents, uv[0], uv[1], colors, joints, weights,
                 morphTargets, indices);
  expectNoneCounts(print_, name);
  auto& [targetPositions, targetNormals, targetTangents] = morphTargets[0];
  expectAllCount(print_, targetPositions, targetNormals, targetTangents);

  auto& [tape, domain, localFromWorld, quadric] = *surface_;
  auto& [code, a, b, constant] = tape.back();
  expectAllCount(print_, code, a, b, constant, tape, domain.min, domain.max, localFromWorld.linear,
                 localFromWorld.offset);
  const std::uint64_t withSurface = print_();
  surface.reset();
  EXPECT_NE(print_(), withSurface);
}

TEST_F(SceneFingerprint, HasTheWholeOfAMaterial) {
  auto& [name, baseColor, baseColorTexture, emissive, emissiveTexture, normalTexture, normalScale,
         specularLevel, roughness, lobe, metallicRoughnessTexture, metallicFactor, roughnessFactor,
         dielectricF0, dielectricF90, reflectionTint, albedoTint, refraction, alphaMode,
         alphaCutoff, baseAlpha, unlit] = scene_.materials[0];
  expectAllCount(print_, baseColor, emissive, normalScale, specularLevel, roughness, lobe,
                 metallicFactor, roughnessFactor, dielectricF0, dielectricF90, reflectionTint,
                 albedoTint, refraction, alphaMode, alphaCutoff, baseAlpha, unlit);
  for (TextureSlot* slot :
       {&baseColorTexture, &emissiveTexture, &normalTexture, &metallicRoughnessTexture}) {
    auto& [texture, uvSet, transform] = *slot;
    expectAllCount(print_, texture, uvSet, transform[0], transform[1], transform[2]);
  }
  expectNoneCounts(print_, name);
}

TEST_F(SceneFingerprint, HasTheWholeOfATexture) {
  auto& [name, srgb, nearest, wrapS, wrapT, levels] = scene_.textures[0];
  auto& [width, height, rgba] = levels[0];
  expectAllCount(print_, srgb, nearest, wrapS, wrapT, width, height, rgba);
  expectNoneCounts(print_, name);
}

TEST_F(SceneFingerprint, HasTheWholeOfWhatMoves) {
  auto& [nodeName, parent, hasMatrix, matrix, translation, rotation, scale, skin, morphWeights] =
      scene_.nodes[0];
  expectAllCount(print_, parent, hasMatrix, matrix, translation, rotation, scale, skin,
                 morphWeights);
  expectNoneCounts(print_, nodeName);
  auto& [joints, inverseBind] = scene_.skins[0];
  expectAllCount(print_, joints, inverseBind);
  auto& [node, target, interpolation, times, values] = scene_.animation[0];
  expectAllCount(print_, node, target, interpolation, times, values);
}

TEST_F(SceneFingerprint, HasTheWholeOfObjectsLightsAndCameras) {
  // Configs give reflectors their methods by the names of objects.
  auto& [objectName, mesh, objectNode, material, nodeFromInstance, reflector, planar] =
      scene_.objects[0];
  expectAllCount(print_, objectName, mesh, objectNode, material, nodeFromInstance, reflector,
                 planar);

  auto& [lightName, type, intensity, range, innerConeRad, outerConeRad, radius, baked, lightNode,
         position, direction] = scene_.lights[0];
  expectAllCount(print_, type, intensity, range, innerConeRad, outerConeRad, radius, baked,
                 lightNode, position, direction);
  auto& [cameraName, cameraNode, verticalFovRad, nearMetres] = scene_.cameras[0];
  expectAllCount(print_, cameraNode, verticalFovRad, nearMetres);
  expectNoneCounts(print_, lightName, cameraName);
}

}  // namespace
}  // namespace catoptric::scene
