// The fixture of tests that load valid glTF files: a writer, its folder, and helpers for
// expectations.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "scene/animate.h"
#include "scene/finish.h"
#include "scene/gltf/test_writer.h"
#include "scene/loader.h"

namespace catoptric::scene::testing {

inline std::vector<Vec3> worldPositions(const Scene& scene, std::size_t object = 0,
                                        double time = 0.0) {
  return worldVertices(scene, scene.objects[object], poseAt(scene, time)).positions;
}

inline void expectNear(const Vec3& actual, const Vec3& expected, float tolerance = 1e-6f) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

inline bool hasNote(const Scene& scene, const std::string& part) {
  for (const std::string& note : scene.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

class Gltf : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  GltfWriter w;

  Scene load() const { return loadGltf(w.gltf(folder)); }
  /// The finished material of a file that has the plain triangle with this material.
  Material materialOf(const std::string& json) {
    w = triangleFile();
    w.arrays["meshes"] = {
        R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]})"};
    w.add("materials", json);
    Scene scene = load();
    finishScene(scene);
    return scene.materials[0];
  }
  /// Draws a mesh of positions alone in `mode`. Returns the x coordinates of the corners of the
  /// resulting triangles.
  std::vector<float> cornersOf(int mode, bool indexed) {
    w = {};
    w.floats({0, 0, 0, 1, 5, 0, 2, 0, 1, 3, 4, 2, 4, 0, 7}, "VEC3");
    const int indices =
        w.accessor(w.view(bytesOf(std::vector<std::uint8_t>{4, 3, 2, 1, 0})), 5121, "SCALAR", 5);
    w.add("meshes", R"({"primitives":[{"attributes":{"POSITION":0},"mode":)" +
                        std::to_string(mode) +
                        (indexed ? ",\"indices\":" + std::to_string(indices) : "") + "}]}");
    w.add("nodes", R"({"mesh":0})");
    const Scene scene = load();
    std::vector<float> corners;
    for (const std::uint32_t i : scene.meshes.at(0).indices) {
      corners.push_back(scene.meshes[0].positions[i].x);
    }
    return corners;
  }
};

}  // namespace catoptric::scene::testing
