// finishScene and worldVertices on scenes made by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "scene/animate.h"
#include "scene/finish.h"
#include "scene/loader.h"
#include "scene/tangents.h"
#include "scene/texture.h"

namespace catoptric::scene {
namespace {

void expectNear(const Vec3& actual, const Vec3& expected, float tolerance = 1e-5f) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

/// A unit square in the xy plane facing +z, with the image upright on it: v grows downwards.
Mesh square() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals.assign(4, Vec3(0, 0, 1));
  mesh.uv[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

Scene sceneOf(Mesh mesh, const Material& material = {}) {
  Scene scene;
  scene.meshes.push_back(std::move(mesh));
  scene.materials.push_back(material);
  scene.nodes.emplace_back();
  Object object;
  object.mesh = object.node = object.material = 0;
  scene.objects.push_back(object);
  return scene;
}

Texture constantTexture(std::uint8_t r, std::uint8_t g, std::uint8_t b) {
  Texture texture;
  texture.srgb = false;
  texture.levels = makeMipChain(1, 1, {r, g, b, 255}, false);
  return texture;
}

Material normalMapped() {
  Material material;
  material.normalTexture.texture = 0;
  return material;
}

TEST(Finish, NormalsBecomeUnitAndMissingOnesComeFromTriangles) {
  Mesh mesh = square();
  mesh.normals = {{0, 0, 5}, {0, 0, 0}, {1e-30f, 0, 0}, {0, 3, 4}};
  Scene scene = sceneOf(mesh);
  finishScene(scene);
  expectNear(scene.meshes[0].normals[0], Vec3(0, 0, 1));
  expectNear(scene.meshes[0].normals[1], Vec3(0, 0, 1));
  expectNear(scene.meshes[0].normals[2], Vec3(0, 0, 1));
  expectNear(scene.meshes[0].normals[3], Vec3(0, 0.6f, 0.8f));
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].rfind("2 vertices without a normal", 0), 0u) << scene.notes[0];
}

TEST(Finish, TangentsFollowTheImage) {
  Scene scene = sceneOf(square(), normalMapped());
  scene.textures.push_back(constantTexture(128, 128, 255));
  finishScene(scene);
  // +u is +x; up in the image is +y = cross(normal, tangent) * w.
  for (const Vec4& t : scene.meshes[0].tangents) {
    expectNear(Vec3(t), Vec3(1, 0, 0));
    EXPECT_EQ(t.w, 1.0f);
  }
  EXPECT_TRUE(scene.notes.empty());
}

TEST(Finish, MirroredImageHasTheOtherSide) {
  Mesh mesh = square();
  for (Vec2& uv : mesh.uv[0]) uv.x = -uv.x;
  makeTangents(mesh, {0, 0});
  for (const Vec4& t : mesh.tangents) {
    expectNear(Vec3(t), Vec3(-1, 0, 0));
    EXPECT_EQ(t.w, -1.0f);
  }
}

TEST(Finish, TextureTransformTurnsTangents) {
  // u' = v, v' = -u: u' grows where the image goes down, along -y.
  Mesh mesh = square();
  TextureSlot slot;
  slot.texture = 0;
  slot.transform = {0.0f, -1.0f, 1.0f, 0.0f, 0.0f, 0.0f};
  makeTangents(mesh, slot);
  for (const Vec4& t : mesh.tangents) {
    expectNear(Vec3(t), Vec3(0, -1, 0));
    EXPECT_EQ(t.w, 1.0f);
  }
}

TEST(Finish, VerticesBetweenMirroredHalvesAreSplit) {
  // Two triangles share the edge x = 0 and mirror the image there.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}};
  mesh.normals.assign(4, Vec3(0, 0, 1));
  mesh.uv[0] = {{0, 1}, {0, 0}, {1, 1}, {1, 1}};
  mesh.indices = {0, 2, 1, 0, 1, 3};
  EXPECT_EQ(makeTangents(mesh, {0, 0}), 0u);
  ASSERT_EQ(mesh.positions.size(), 6u);
  ASSERT_EQ(mesh.uv[0].size(), 6u);
  ASSERT_EQ(mesh.normals.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const Vec4 t = mesh.tangents[mesh.indices[i]];
    expectNear(Vec3(t), Vec3(i < 3 ? 1.0f : -1.0f, 0, 0));
    EXPECT_EQ(t.w, i < 3 ? 1.0f : -1.0f);
  }
  expectNear(mesh.positions[mesh.indices[3]], Vec3(0, 0, 0));
  expectNear(mesh.positions[mesh.indices[4]], Vec3(0, 1, 0));
}

TEST(Finish, DegenerateTrianglesMakeNoNan) {
  Mesh mesh = square();
  mesh.indices = {0, 0, 0, 0, 1, 0, 0, 1, 2, 3, 3, 2};
  mesh.uv[0] = {{0, 0}, {0, 0}, {0, 0}, {0, 0}};
  mesh.normals.assign(4, Vec3(0.0f));
  Scene scene = sceneOf(mesh, normalMapped());
  scene.textures.push_back(constantTexture(128, 128, 255));
  finishScene(scene);
  const Mesh& finished = scene.meshes[0];
  EXPECT_EQ(scene.triangleCount(), 4u);
  for (std::size_t i = 0; i < finished.positions.size(); ++i) {
    EXPECT_NEAR(glm::length(finished.normals[i]), 1.0f, 1e-5f);
    const Vec3 t(finished.tangents[i]);
    EXPECT_NEAR(glm::length(t), 1.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(t, finished.normals[i]), 0.0f, 1e-5f);
  }
  EXPECT_EQ(scene.notes.size(), 2u);
}

TEST(Finish, TangentsOnASphereAreUnitPerpendicularAndAlongU) {
  Mesh mesh;
  constexpr int kAround = 48;
  constexpr int kUp = 24;
  for (int j = 0; j <= kUp; ++j) {
    for (int i = 0; i <= kAround; ++i) {
      const float phi = 2.0f * kPi * static_cast<float>(i) / kAround;
      const float theta = kPi * static_cast<float>(j) / kUp;
      const Vec3 p(std::sin(theta) * std::sin(phi), std::cos(theta),
                   std::sin(theta) * std::cos(phi));
      mesh.positions.push_back(p);
      mesh.normals.push_back(glm::normalize(p));
      mesh.uv[0].emplace_back(static_cast<float>(i) / kAround, static_cast<float>(j) / kUp);
    }
  }
  for (std::uint32_t j = 0; j < kUp; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t a = j * (kAround + 1) + i;
      const std::uint32_t b = a + kAround + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  }
  EXPECT_LE(makeTangents(mesh, {0, 0}), 2u);  // corners of pole triangles without area
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3 t(mesh.tangents[i]);
    EXPECT_NEAR(glm::length(t), 1.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(t, mesh.normals[i]), 0.0f, 1e-5f);
    const Vec3 p = mesh.positions[i];
    if (std::abs(p.y) > 0.95f) continue;
    // The direction of growing longitude, exactly; v grows to the south pole, image up is north.
    const Vec3 east = glm::normalize(Vec3(p.z, 0.0f, -p.x));
    EXPECT_GT(glm::dot(t, east), 0.995f);
    EXPECT_EQ(mesh.tangents[i].w, 1.0f);
  }
}

TEST(Finish, TangentsNobodyNeedsAreDropped) {
  Mesh mesh = square();
  mesh.tangents.assign(4, Vec4(1, 0, 0, 1));
  Scene scene = sceneOf(mesh);
  finishScene(scene);
  EXPECT_TRUE(scene.meshes[0].tangents.empty());
}

TEST(Finish, GivenTangentsAreKeptAndMadePerpendicular) {
  Mesh mesh = square();
  mesh.tangents.assign(4, Vec4(0, 2, 1, -1));
  mesh.tangents[3] = Vec4(0, 0, 1, 1);  // along the normal
  Scene scene = sceneOf(mesh, normalMapped());
  scene.textures.push_back(constantTexture(128, 128, 255));
  finishScene(scene);
  expectNear(Vec3(scene.meshes[0].tangents[0]), Vec3(0, 1, 0));
  EXPECT_EQ(scene.meshes[0].tangents[0].w, -1.0f);
  EXPECT_NEAR(glm::dot(Vec3(scene.meshes[0].tangents[3]), Vec3(0, 0, 1)), 0.0f, 1e-6f);
}

TEST(Finish, PlanarNeedsPositionsNormalsAndNoNormalMap) {
  Scene scene = sceneOf(square());
  finishScene(scene);
  EXPECT_TRUE(scene.objects[0].planar);

  Mesh bent = square();
  bent.positions[2].z = 1e-3f;
  scene = sceneOf(bent);
  finishScene(scene);
  EXPECT_FALSE(scene.objects[0].planar);

  Mesh smooth = square();  // a flat piece with the normals of a cushion
  smooth.normals[1] = glm::normalize(Vec3(0.1f, 0, 1));
  scene = sceneOf(smooth);
  finishScene(scene);
  EXPECT_FALSE(scene.objects[0].planar);

  scene = sceneOf(square(), normalMapped());
  scene.textures.push_back(constantTexture(128, 128, 255));
  finishScene(scene);
  EXPECT_FALSE(scene.objects[0].planar);

  Mesh deforming = square();
  deforming.morphTargets.emplace_back().positions.assign(4, Vec3(0, 0, 1));
  scene = sceneOf(deforming);
  finishScene(scene);
  EXPECT_FALSE(scene.objects[0].planar);
}

TEST(Finish, TexturesDecideWhatReflects) {
  Material material;
  material.metallicFactor = 1.0f;
  material.roughnessFactor = 0.5f;
  material.metallicRoughnessTexture.texture = 0;
  Scene scene = sceneOf(square(), material);
  scene.textures.push_back(constantTexture(0, 204, 0));  // nowhere metallic
  finishScene(scene);
  EXPECT_EQ(scene.objects[0].reflector, 0);
  EXPECT_EQ(scene.materials[0].specularLevel, 0.0f);

  scene = sceneOf(square(), material);
  scene.textures.push_back(constantTexture(0, 204, 255));
  finishScene(scene);
  EXPECT_EQ(scene.objects[0].reflector, 1);
  EXPECT_FLOAT_EQ(scene.materials[0].specularLevel, 1.0f);
  EXPECT_NEAR(scene.materials[0].roughness, 0.4f, 1e-6f);
}

TEST(Finish, DielectricsReflectWhereTheyAreLet) {
  const auto reflects = [](const Material& material, bool dielectrics) {
    Scene scene = sceneOf(square(), material);
    if (dielectrics) letDielectricsReflect(scene);
    finishScene(scene);
    const std::uint64_t fingerprint = scene.fingerprint;
    finishScene(scene);
    EXPECT_EQ(scene.fingerprint, fingerprint);
    EXPECT_EQ(scene.objects[0].reflector, scene.materials[0].specularLevel > 0.0f ? 1 : 0);
    return scene.materials[0].specularLevel;
  };
  Material plastic;
  plastic.lobe = LobeModel::Ggx;
  EXPECT_EQ(reflects(plastic, false), 0.0f);
  EXPECT_FLOAT_EQ(reflects(plastic, true), 0.04f);
  Material paper = plastic;
  paper.lobe = LobeModel::Phong;  // of a description's material without glTF's terms
  EXPECT_EQ(reflects(paper, true), 0.0f);
  Material air = plastic;
  air.dielectricF0 = Vec3(0.0f);
  EXPECT_EQ(reflects(air, true), 0.0f);
  Material unlit = plastic;
  unlit.unlit = true;
  EXPECT_EQ(reflects(unlit, true), 0.0f);
}

TEST(Finish, SetReflectanceIsExactAndTwiceIsOnce) {
  for (const float s : {0.05f, 0.0625f, 0.3f, 0.7f, 1.0f}) {
    Material material;
    setReflectance(material, s, 0.2f);
    Scene scene = sceneOf(square(), material);
    finishScene(scene);
    EXPECT_EQ(scene.materials[0].specularLevel, s);
    EXPECT_EQ(scene.materials[0].roughness, 0.2f);
    const std::uint64_t fingerprint = scene.fingerprint;
    finishScene(scene);
    EXPECT_EQ(scene.fingerprint, fingerprint);
    EXPECT_EQ(scene.objects[0].reflector, 1);
  }
}

TEST(WorldVertices, NonUniformScaleKeepsNormalsPerpendicular) {
  // A slope of 45 degrees, stretched: the normal must stay perpendicular to it.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 1, 0}, {0, 0, -1}};
  mesh.normals.assign(3, glm::normalize(Vec3(-1, 1, 0)));
  mesh.indices = {0, 1, 2};
  Scene scene = sceneOf(mesh);
  scene.nodes[0].scale = Vec3(3, 0.5f, 1e-6f);
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0.0));
  EXPECT_NEAR(glm::dot(v.normals[0], glm::normalize(v.positions[1])), 0.0f, 1e-6f);
  EXPECT_NEAR(glm::length(v.normals[0]), 1.0f, 1e-6f);
  EXPECT_GT(v.normals[0].y, 0.0f);
  EXPECT_FALSE(v.flipWinding);
  // Flattened to nothing, normals are still unit.
  scene.nodes[0].scale = Vec3(0.0f);
  const WorldVertices flat = worldVertices(scene, scene.objects[0], poseAt(scene, 0.0));
  EXPECT_NEAR(glm::length(flat.normals[0]), 1.0f, 1e-6f);
}

TEST(WorldVertices, MorphTargetsMoveNormalsAndTangents) {
  Mesh mesh = square();
  mesh.tangents.assign(4, Vec4(1, 0, 0, -1));
  MorphTarget& target = mesh.morphTargets.emplace_back();
  target.positions.assign(4, Vec3(0, 0, 2));
  target.normals.assign(4, Vec3(0, 2, 0));
  target.tangents.assign(4, Vec3(0, 2, -2));
  Scene scene = sceneOf(mesh);
  scene.nodes[0].morphWeights = {0.5f};
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0.0));
  expectNear(v.positions[0], Vec3(0, 0, 1));
  expectNear(v.normals[0], glm::normalize(Vec3(0, 1, 1)));
  expectNear(Vec3(v.tangents[0]), glm::normalize(Vec3(1, 1, -1)));
  EXPECT_EQ(v.tangents[0].w, -1.0f);
}

// Of a skinned object the joints move it; its own node does not.
TEST(Moving, SkinnedObjectsFollowTheirJointsAlone) {
  for (const int animated : {0, 1}) {
    Mesh mesh = square();
    mesh.joints.assign(4, glm::u16vec4(0));
    mesh.weights.assign(4, Vec4(1, 0, 0, 0));
    Scene scene = sceneOf(mesh);
    scene.nodes.emplace_back();
    scene.nodes[0].skin = 0;
    Skin& skin = scene.skins.emplace_back();
    skin.joints = {1};
    skin.inverseBind = {Mat4(1.0f)};
    AnimationChannel& channel = scene.animation.emplace_back();
    channel.node = animated;
    channel.target = Target::Translation;
    channel.times = {0.0f, 1.0f};
    channel.values = {0, 0, 0, 1, 0, 0};
    const std::vector<bool> moves = {animated == 1};
    EXPECT_EQ(movingObjects(scene), moves);
    EXPECT_EQ(deformingObjects(scene), moves);
    expectNear(worldVertices(scene, scene.objects[0], poseAt(scene, 1.0)).positions[0],
               Vec3(animated == 1 ? 1.0f : 0.0f, 0, 0));
  }
}

TEST(WorldVertices, MirroringTurnsTheBitangentAlong) {
  Scene scene = sceneOf(square(), normalMapped());
  scene.textures.push_back(constantTexture(128, 128, 255));
  scene.nodes[0].scale = Vec3(1, -1, 1);
  finishScene(scene);
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0.0));
  EXPECT_TRUE(v.flipWinding);
  // The image's up, +y before, is -y now.
  const Vec3 up = glm::cross(v.normals[0], Vec3(v.tangents[0])) * v.tangents[0].w;
  expectNear(up, Vec3(0, -1, 0));
}

TEST(Finish, FarScenesGetAnOriginOfTheirOwn) {
  // The square 0.3 beside a parent at 1e5: in floats of the file's coordinates 0.3 would be
  // 0.296875
  Scene scene = sceneOf(square());
  scene.nodes.insert(scene.nodes.begin(), Node{});
  scene.nodes[0].translation = Vec3(1e5f, -1e5f, 0.0f);
  scene.nodes[1].parent = 0;
  scene.nodes[1].translation = Vec3(0.3f, 0.0f, 0.0f);
  scene.objects[0].node = 1;
  Light light;
  light.position = Vec3(1e5f, -1e5f, 2.0f);
  scene.lights.push_back(light);
  finishScene(scene);
  EXPECT_EQ(scene.origin, glm::dvec3(1e5, -1e5, 0.0));
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0.0));
  expectNear(v.positions[0], Vec3(0.3f, 0.0f, 0.0f), 1e-7f);
  expectNear(scene.lights[0].position, Vec3(0.0f, 0.0f, 2.0f), 0.0f);

  Scene near = sceneOf(square());
  near.nodes[0].translation = Vec3(20.0f, 0.0f, 0.0f);
  finishScene(near);
  EXPECT_EQ(near.origin, glm::dvec3(0.0));
}

TEST(Check, MorphedVerticesStayWithinTheLimit) {
  for (const float side : {-1.0f, 1.0f})
    for (const float weight : {-1.0f, 1.0f}) {
      Scene scene = sceneOf(square());
      scene.nodes[0].morphWeights = {weight};
      std::vector<Vec3>& deltas = scene.meshes[0].morphTargets.emplace_back().positions;
      deltas.assign(4, Vec3(0.9f * side * kMaxCoordinate, 0, 0));
      EXPECT_NO_THROW(checkScene(scene)) << side << weight;
      deltas[2].x = 1.1f * side * kMaxCoordinate;
      EXPECT_THROW(checkScene(scene), SceneError) << side << weight;
    }
}

TEST(Finish, WarnsOfShapesThatFloatsCannotHold) {
  const auto warnings = [](const Vec3& second) {
    Scene scene = sceneOf(square());
    scene.nodes.emplace_back();
    scene.nodes.back().translation = second;
    scene.objects.push_back(scene.objects[0]);
    scene.objects.back().name = "far one";
    scene.objects.back().node = 1;
    finishScene(scene);
    return scene.warnings;
  };
  EXPECT_TRUE(warnings({1e4f, 0.0f, 0.0f}).empty());  // floats are 1 mm apart
  EXPECT_TRUE(warnings({0.0f, 0.0f, 0.0f}).empty());
  const std::vector<std::string> lost = warnings({0.0f, 0.0f, -1e8f});
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].rfind("\"far one\" is 1.4 m large and lies 1e+08 m from", 0), 0u) << lost[0];

  // Where all is far away the scene's own origin takes it off
  Scene scene = sceneOf(square());
  scene.nodes[0].translation = Vec3(1e6f, 0.0f, 0.0f);
  finishScene(scene);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(Finish, WarnsOfObjectsWithoutArea) {
  const auto warnings = [](const Vec3& scale) {
    Scene scene = sceneOf(square());
    scene.nodes[0].scale = scale;
    scene.objects[0].name = "sheet";
    scene.objects.push_back(scene.objects[0]);
    finishScene(scene);
    return scene.warnings;
  };
  EXPECT_TRUE(warnings(Vec3(1.0f)).empty());
  for (const Vec3& scale : {Vec3(0.0f), Vec3(1.0f, 0.0f, 0.0f)}) {
    ASSERT_EQ(warnings(scale).size(), 1u);
    EXPECT_EQ(warnings(scale)[0],
              "not drawn, since they have no area (is their scale 0?): \"sheet\" and 1 more");
  }
}

TEST(Finish, WarnsOfTrianglesThatRasterizersLose) {
  const auto warnings = [](float scale) {
    Scene scene = sceneOf(square());
    scene.objects[0].name = "floor";
    scene.nodes[0].scale = Vec3(scale, scale, 1.0f);
    finishScene(scene);
    return scene.warnings;
  };
  EXPECT_TRUE(warnings(1e6f).empty());
  const std::vector<std::string> large = warnings(1e8f);
  ASSERT_EQ(large.size(), 1u);
  EXPECT_EQ(large[0].rfind("\"floor\" has a triangle with an edge of 1.4e+08 m", 0), 0u)
      << large[0];
}

}  // namespace
}  // namespace catoptric::scene
