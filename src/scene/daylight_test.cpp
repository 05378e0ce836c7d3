// The light and the ground of bare glTF files, and the triangles that are made finer for them.
#include "scene/daylight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "core/error.h"
#include "scene/camera.h"
#include "scene/gltf/test_fixture.h"
#include "scene/shapes/shapes.h"
#include "scene/subdivide.h"

namespace catoptric::scene {
namespace {

using testing::Gltf;
using ::testing::HasSubstr;
using testing::triangleFile;

using Place = std::array<float, 3>;

Place placeOf(const Vec3& p) {
  return {p.x, p.y, p.z};
}

double volumeOf(const Mesh& mesh) {
  double volume = 0.0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t* t = &mesh.indices[i];
    volume +=
        glm::dot(glm::dvec3(mesh.positions[t[0]]),
                 glm::cross(glm::dvec3(mesh.positions[t[1]]), glm::dvec3(mesh.positions[t[2]])));
  }
  return volume / 6.0;
}

TEST(Subdivide, LeavesNoLongEdgeAndNoGap) {
  // Each face of the box has vertices of its own: gaps would open where faces meet.
  BoxShape shape;
  shape.size = Vec3(1.0f, 0.3f, 2.7f);
  Mesh mesh = makeBox(shape, UvMode::Unit);
  subdivide(mesh, Vec3(1.0f), 0.25f);
  EXPECT_NEAR(volumeOf(mesh), 0.81, 1e-6);
  std::map<std::pair<Place, Place>, int> edges;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const Vec3 a = mesh.positions[mesh.indices[i]];
    const Vec3 b = mesh.positions[mesh.indices[i % 3 == 2 ? i - 2 : i + 1]];
    EXPECT_LE(glm::length(a - b), 0.25f);
    ++edges[{placeOf(a), placeOf(b)}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_EQ(mesh.uv[0].size(), mesh.positions.size());
  for (const Vec3& n : mesh.normals) EXPECT_NEAR(glm::length(n), 1.0f, 1e-6f);
}

TEST(Subdivide, LeavesFineAndDeformingMeshesAlone) {
  Mesh mesh = makePlane(Vec2(1.0f), glm::ivec2(4), UvMode::Unit);
  const std::vector<std::uint32_t> indices = mesh.indices;
  subdivide(mesh, Vec3(1.0f), 0.4f);
  EXPECT_EQ(mesh.indices, indices);
  mesh.morphTargets.emplace_back();
  subdivide(mesh, Vec3(1.0f), 0.1f);
  EXPECT_EQ(mesh.indices, indices);
}

TEST_F(Gltf, DaylightAddsABoundedNumberOfTriangles) {
  const std::size_t most = 200'000;
  // A mesh of 1e5 metres that a node makes as wide as it is high
  w = {};
  std::vector<float> places;
  std::vector<std::uint16_t> corners;
  for (std::uint16_t i = 0; i <= 100; ++i) {
    const float y = static_cast<float>(i) / 100.0f;
    places.insert(places.end(), {0, y, 0, 1e5f, y, 0});
    const auto a = static_cast<std::uint16_t>(2 * i);
    if (i == 100) break;
    for (const int next : {0, 1, 2, 1, 3, 2})
      corners.push_back(static_cast<std::uint16_t>(a + next));
  }
  w.floats(places, "VEC3");
  w.indices(corners);
  w.add("meshes", R"({"primitives":[{"attributes":{"POSITION":0},"indices":1}]})");
  w.add("nodes", R"({"mesh":0,"scale":[1e-5,1,1]})");
  EXPECT_GT(loadScene(w.gltf(folder)).triangleCount(), 1000u);
  EXPECT_LT(loadScene(w.gltf(folder)).triangleCount(), most);
  // One large copy of a triangle among many that are small
  w = triangleFile();
  w.arrays.erase("scenes");
  for (int i = 0; i < 2000; ++i) w.add("nodes", R"({"mesh":0,"scale":[0.01,0.01,0.01]})");
  EXPECT_GT(loadScene(w.gltf(folder)).triangleCount(), 4000u);
  EXPECT_LT(loadScene(w.gltf(folder)).triangleCount(), most);
}

TEST_F(Gltf, TheGroundLiesBelowAndOutsideOfWhatCamerasFit) {
  w = triangleFile();
  const std::filesystem::path file = w.gltf(folder);
  const Scene bare = loadScene(file);
  for (const Ground kind : {Ground::Matte, Ground::Mirror}) {
    const Scene scene = loadScene(file, {}, {}, kind);
    ASSERT_EQ(scene.objects.size(), bare.objects.size() + 1);
    EXPECT_EQ(scene.ground, static_cast<int>(bare.objects.size()));
    const Object& ground = scene.objects.back();
    EXPECT_EQ(ground.reflector > 0, kind == Ground::Mirror);
    EXPECT_TRUE(ground.planar);
    Box3 box;
    for (const Vec3& p : scene.meshes.back().positions) box.extend(p);
    const Box3 model = boundsAtStart(bare);
    EXPECT_LT(box.max.y, model.min.y);
    EXPECT_GT(box.max.y, model.min.y - 0.01f * model.diameter());
    EXPECT_GT(box.max.x, 10.0f * model.diameter());
    EXPECT_EQ(boundsAtStart(scene).diameter(), model.diameter());
    for (const char* name : {"front", "three_quarter", "turntable:4"}) {
      const Camera camera = cameraPath(name, scene)->frame(1).camera;
      EXPECT_EQ(camera == cameraPath(name, bare)->frame(1).camera, kind == Ground::Matte);
      if (kind == Ground::Matte) continue;
      const Mat4 clip = clipFromCamera(camera, 1.0f) * cameraFromWorld(camera);
      for (const Vec3& p : bare.meshes[0].positions)
        for (const float y : {p.y, 2.0f * box.max.y - p.y}) {
          const Vec4 at = clip * Vec4(p.x, y, p.z, 1.0f);
          EXPECT_LT(std::max(std::abs(at.x), std::abs(at.y)), at.w) << name;
        }
    }
    EXPECT_NE(scene.fingerprint, bare.fingerprint);
  }
  // Whatever lights the model, its light is baked, so that the ground receives shadows.
  Environment white;
  white.color = Vec3(1.0f);
  EXPECT_EQ(loadScene(file, {}, white, Ground::Matte).bake.mode, BakeMode::Full);
}

// A shadow whose penumbra is a cell wide, as vertices show it: its edge is straight in all
// directions.
TEST(Ground, EdgesOfShadowsHaveNoTeeth) {
  Scene scene;
  BoxShape box;
  box.size = Vec3(1.0f, 0.5f, 1.0f);
  scene.meshes.push_back(makeBox(box, UvMode::Unit));
  scene.materials.emplace_back();
  scene.objects.emplace_back();
  scene.objects[0].mesh = scene.objects[0].material = 0;
  addGround(scene, Ground::Mirror);
  const Mesh& ground = scene.meshes.back();
  constexpr float kCell = 1.6f / 128.0f;  // the box and 0.6 of its height on either side
  float worst = 0.0f;
  for (int i = 0; i < 24; ++i) {
    const float angle = kPi / 24.0f * static_cast<float>(i);
    const Vec3 across(std::cos(angle), 0.0f, std::sin(angle));
    const auto away = [&](std::uint32_t v) {  // from the edge, in cells
      return glm::dot(across, ground.positions[v]) / kCell + 0.3f;
    };
    for (std::size_t k = 0; k < ground.indices.size(); ++k) {
      const float a = away(ground.indices[k]);
      const float b = away(ground.indices[k % 3 == 2 ? k - 2 : k + 1]);
      const float lightA = std::clamp(0.5f + a, 0.0f, 1.0f);
      const float lightB = std::clamp(0.5f + b, 0.0f, 1.0f);
      const Vec3& place = ground.positions[ground.indices[k]];
      if ((a < 0.0f) == (b < 0.0f) || std::max(std::abs(place.x), std::abs(place.z)) > 0.7f)
        continue;
      // Where the light between both corners is one half
      const float share = (0.5f - lightA) / (lightB - lightA);
      worst = std::max(worst, std::abs(glm::mix(a, b, share)));
    }
  }
  EXPECT_GT(worst, 0.01f);
  EXPECT_LT(worst, 0.15f);
}

TEST(Ground, CoversEveryPlaceOnceFacingUp) {
  Scene scene;
  scene.meshes.push_back(makeBox({}, UvMode::Unit));
  scene.materials.emplace_back();
  scene.objects.emplace_back();
  scene.objects[0].mesh = scene.objects[0].material = 0;
  addGround(scene, Ground::Matte);
  const Mesh& ground = scene.meshes.back();
  Box3 box;
  for (const Vec3& p : ground.positions) box.extend(p);
  double area = 0.0;
  for (std::size_t i = 0; i + 2 < ground.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) {
      return glm::dvec3(ground.positions[ground.indices[i + k]]);
    };
    const double up = glm::cross(corner(1) - corner(0), corner(2) - corner(0)).y;
    ASSERT_GT(up, 0.0);
    area += 0.5 * up;
  }
  const double whole = static_cast<double>(box.max.x - box.min.x) * (box.max.z - box.min.z);
  EXPECT_NEAR(area, whole, 1e-6 * whole);
}

TEST_F(Gltf, AGroundBelowMovingObjectsWarnsThatLightIsBaked) {
  w = triangleFile();
  const int times = w.floats({0, 1}, "SCALAR");
  const int places = w.floats({0, 0, 0, 1, 0, 0}, "VEC3");
  w.add("animations",
        R"({"samplers":[{"input":)" + std::to_string(times) +
            ",\"output\":" + std::to_string(places) +
            R"(}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]})");
  const std::filesystem::path file = w.gltf(folder);
  EXPECT_THAT(loadScene(file).warnings, ::testing::IsEmpty());
  EXPECT_THAT(loadScene(file, {}, {}, Ground::Matte).warnings,
              ::testing::ElementsAre(::testing::HasSubstr("cast no shadow")));
}

TEST_F(Gltf, DescriptionsGetNoGround) {
  const auto file = folder.write("scene.json", R"({"objects": [{"shape": "sphere"}]})");
  try {
    loadScene(file, {}, {}, Ground::Matte);
    ADD_FAILURE() << "no error";
  } catch (const SceneError& error) {
    EXPECT_THAT(error.what(), HasSubstr("gets no ground; add a plane"));
  }
}

}  // namespace
}  // namespace catoptric::scene
