// Skins, morph targets and animations of glTF files, against values known on paper.
#include "scene/gltf/test_fixture.h"

namespace catoptric::scene {
namespace {

using ::testing::ElementsAre;
using namespace catoptric::scene::testing;

TEST_F(Gltf, SkinFollowsHandComputedMatrices) {
  w = triangleFile();
  const int joints =
      w.accessor(w.view(bytesOf(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 9, 9})),
                 5121, "VEC4", 3);
  const int weights = w.accessor(
      w.view(bytesOf(std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 51, 204, 0, 0})), 5121,
      "VEC4", 3, R"("normalized":true)");
  // The bind pose of joint 1 stands at (1,0,0): its inverse moves by (-1,0,0).
  const int bind = w.floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                             1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1},
                            "MAT4");
  w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"JOINTS_0":)" +
                        std::to_string(joints) + ",\"WEIGHTS_0\":" + std::to_string(weights) +
                        "},\"indices\":2}]}"};
  w.add("skins", R"({"joints":[1,2],"inverseBindMatrices":)" + std::to_string(bind) + "}");
  w.arrays["nodes"] = {R"({"mesh":0,"skin":0,"translation":[1000,0,0]})",
                       R"({"translation":[0,0,1],"children":[2]})",
                       // joint 1: turned by 90 degrees about +z, at (1,0,1) in the world
                       R"({"translation":[1,0,0],"rotation":[0,0,0.70710678,0.70710678]})"};
  w.arrays["scenes"] = {R"({"nodes":[0,1]})"};
  const Scene scene = load();
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0));
  // Vertex 0 by joint 0; vertex 1 is at the origin of joint 1; vertex 2 = (0,1,0) is taken by
  // joint 0 to (0,1,1), by joint 1 to R(-1,1,0) + (1,0,1) = (-1,-1,0) + (1,0,1) = (0,-1,1), and
  // mixed 1:4. The node's own transform does not count.
  expectNear(v.positions[0], Vec3(0, 0, 1));
  expectNear(v.positions[1], Vec3(1, 0, 1));
  expectNear(v.positions[2], Vec3(0, 0.2f - 0.8f, 1));
  for (const Vec3& n : v.normals) expectNear(n, Vec3(0, 0, 1));
}

TEST_F(Gltf, EightInfluencesKeepTheStrongestFour) {
  w = triangleFile();
  const auto add = [&](const std::vector<std::uint8_t>& v, const std::vector<float>& weights) {
    const int j = w.accessor(w.view(bytesOf(v)), 5121, "VEC4", 3);
    return std::pair(j, w.floats(weights, "VEC4"));
  };
  const auto [j0, w0] =
      add({0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0}, {0.1f, 0.2f, 0.05f, 0.15f, 1, 0, 0, 0, 1, 0, 0, 0});
  const auto [j1, w1] =
      add({4, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {0.3f, 0.2f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"JOINTS_0":)" +
                        std::to_string(j0) + ",\"WEIGHTS_0\":" + std::to_string(w0) +
                        ",\"JOINTS_1\":" + std::to_string(j1) +
                        ",\"WEIGHTS_1\":" + std::to_string(w1) + "}}]}"};
  const Mesh mesh = load().meshes.at(0);
  EXPECT_EQ(mesh.joints[0], glm::u16vec4(4, 1, 5, 3));
  EXPECT_NEAR(mesh.weights[0].x, 0.3f / 0.85f, 1e-6f);
  EXPECT_NEAR(mesh.weights[0].w, 0.15f / 0.85f, 1e-6f);
}

TEST_F(Gltf, MorphTargetsSparseToo) {
  w = triangleFile();
  const int dense = w.floats({1, 0, 0, 0, 0, 0, 0, 0, 2}, "VEC3");
  const int at = w.view(bytesOf(std::vector<std::uint16_t>{1}));
  const int values = w.view(bytesOf(std::vector<float>{0, 4, 0}));
  const int sparse = w.accessor(
      -1, 5126, "VEC3", 3,
      R"("sparse":{"count":1,"indices":{"bufferView":)" + std::to_string(at) +
          R"(,"componentType":5123},"values":{"bufferView":)" + std::to_string(values) + "}}");
  w.arrays["meshes"] = {
      R"({"weights":[0.5,0.25],"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"targets":[{"POSITION":)" +
      std::to_string(dense) + "},{\"POSITION\":" + std::to_string(sparse) + "}]}]}"};
  w.arrays["nodes"] = {R"({"mesh":0})", R"({"mesh":0,"weights":[1,1]})"};
  w.arrays["scenes"] = {R"({"nodes":[0,1]})"};
  const Scene scene = load();
  EXPECT_THAT(worldPositions(scene, 0),
              ElementsAre(Vec3(0.5f, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 1)));
  EXPECT_THAT(worldPositions(scene, 1), ElementsAre(Vec3(1, 0, 0), Vec3(1, 4, 0), Vec3(0, 1, 2)));
}

TEST_F(Gltf, FlatMorphTargetsTurnTheirNormals) {
  // Without normals the target has flat normals of its own: (0,0,1) turns to (0,-1,1)/sqrt 2.
  w.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
  const int target = w.floats({0, 0, 0, 0, 0, 0, 0, 0, 1}, "VEC3");
  w.add("meshes",
        R"({"weights":[1],"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":)" +
            std::to_string(target) + "}]}]}");
  w.add("nodes", R"({"mesh":0})");
  const Scene scene = load();
  const float h = std::sqrt(0.5f);
  for (const Vec3& n : worldVertices(scene, scene.objects[0], poseAt(scene, 0)).normals) {
    expectNear(n, Vec3(0, -h, h));
  }
}

TEST_F(Gltf, AnimationsOfThreeInterpolations) {
  w = triangleFile();
  const int times = w.floats({1, 2, 4}, "SCALAR");
  const int linear = w.floats({0, 0, 0, 10, 0, 0, 10, 20, 0}, "VEC3");
  const int step = w.floats({1, 1, 1, 2, 2, 2, 3, 3, 3}, "VEC3");
  // CUBICSPLINE: in-tangent, value, out-tangent per key
  const int cubic = w.floats({0, 0, 0, 1, 2, 3, 6, 0, -3,  //
                              3, 0, 0, 4, 2, 0, 0, 0, 1,   //
                              0, 2, 0, 0, 0, 0, 9, 9, 9},
                             "VEC3");
  const float h = std::sqrt(0.5f);
  // the same rotation twice, written with the other sign: the short way is not to turn
  const int rotation = w.floats({0, 0, 0, 1, 0, 0, h, h, 0, 0, -h, -h}, "VEC4");
  w.add("animations",
        R"({"samplers":[{"input":3,"output":)" + std::to_string(linear) +
            R"(},{"input":3,"interpolation":"STEP","output":)" + std::to_string(step) +
            R"(},{"input":3,"interpolation":"CUBICSPLINE","output":)" + std::to_string(cubic) +
            R"(},{"input":3,"interpolation":"LINEAR","output":)" + std::to_string(rotation) +
            R"(}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}},)"
            R"({"sampler":1,"target":{"node":0,"path":"scale"}},)"
            R"({"sampler":2,"target":{"node":1,"path":"translation"}},)"
            R"({"sampler":3,"target":{"node":2,"path":"rotation"}}]})");
  ASSERT_EQ(times, 3);
  w.arrays["nodes"] = {R"({"mesh":0})", R"({"mesh":0})", R"({"mesh":0})"};
  w.arrays["scenes"] = {R"({"nodes":[0,1,2]})"};
  const Scene scene = load();
  EXPECT_TRUE(scene.animated());
  EXPECT_FLOAT_EQ(scene.duration(), 4.0f);
  const auto at = [&](std::size_t object, double time) {
    return worldPositions(scene, object, time);
  };
  // Before, between and after the keys.
  EXPECT_EQ(at(0, 0.0)[0], Vec3(0, 0, 0));
  expectNear(at(0, 1.25)[0], Vec3(2.5f, 0, 0));
  expectNear(at(0, 3.0)[0], Vec3(10, 10, 0));
  expectNear(at(0, 9.0)[0], Vec3(10, 20, 0));
  // STEP holds each key until the next.
  expectNear(at(0, 1.99)[1] - at(0, 1.99)[0], Vec3(1, 0, 0));
  expectNear(at(0, 2.0)[1] - at(0, 2.0)[0], Vec3(2, 0, 0));
  expectNear(at(0, 4.0)[1] - at(0, 4.0)[0], Vec3(3, 0, 0));
  // Hermite: between 1 s and 2 s at t = 0.5 (v0 + v1) / 2 + (b0 - a1) / 8 * 1 s,
  // between 2 s and 4 s at t = 0.25 by the four basis functions.
  expectNear(at(1, 1.5)[0], Vec3(2.5f + 3.0f / 8.0f, 2.0f, 1.5f - 3.0f / 8.0f));
  const float t = 0.25f;
  const float h00 = 2 * t * t * t - 3 * t * t + 1;
  const float h10 = t * t * t - 2 * t * t + t;
  const float h01 = 3 * t * t - 2 * t * t * t;
  const float h11 = t * t * t - t * t;
  expectNear(at(1, 2.5)[0], h00 * Vec3(4, 2, 0) + 2.0f * h10 * Vec3(0, 0, 1) + h01 * Vec3(0, 0, 0) +
                                2.0f * h11 * Vec3(0, 2, 0));
  expectNear(at(1, 4.0)[0], Vec3(0, 0, 0));
  // Slerp: a third of 90 degrees is 30 degrees; then no turn at all.
  const float a = radians(30.0f);
  expectNear(at(2, 1.0 + 1.0 / 3.0)[1], Vec3(std::cos(a), std::sin(a), 0));
  expectNear(at(2, 3.0)[1], Vec3(0, 1, 0));
  EXPECT_EQ(movingObjects(scene), (std::vector<bool>{true, true, true}));
}

TEST_F(Gltf, AnimatedMorphWeightsAndWhatMoves) {
  w = triangleFile();
  const int target = w.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  const int times = w.floats({0, 1}, "SCALAR");
  const int weights = w.accessor(w.view(bytesOf(std::vector<std::uint8_t>{0, 255})), 5121, "SCALAR",
                                 2, R"("normalized":true)");
  const int turn = w.floats({0, 0, 0, 1, 0, 1, 0, 0}, "VEC4");
  w.add("meshes",
        R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"targets":[{"POSITION":)" +
            std::to_string(target) + "}]}]}");
  w.arrays["nodes"] = {R"({"mesh":1})", R"({"children":[2]})", R"({"mesh":0})", R"({"mesh":0})"};
  w.arrays["scenes"] = {R"({"nodes":[0,1,3]})"};
  w.add("animations", R"({"samplers":[{"input":)" + std::to_string(times) + ",\"output\":" +
                          std::to_string(weights) + "},{\"input\":" + std::to_string(times) +
                          ",\"output\":" + std::to_string(turn) +
                          R"(}],"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}},)"
                          R"({"sampler":1,"target":{"node":1,"path":"rotation"}}]})");
  const Scene scene = load();
  expectNear(worldPositions(scene, 0, 0.25)[1], Vec3(1, 0, 0.25f));
  EXPECT_EQ(movingObjects(scene), (std::vector<bool>{true, true, false}));
}

}  // namespace
}  // namespace catoptric::scene
