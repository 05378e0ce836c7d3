// What loadGltf makes of valid files, against values known on paper.
#include "core/error.h"
#include "scene/camera.h"
#include "scene/gltf/test_fixture.h"

namespace catoptric::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace catoptric::scene::testing;

TEST_F(Gltf, TriangleInBothContainersAndBesideItsBuffer) {
  w = triangleFile();
  std::filesystem::create_directory(folder.path() / "a b");
  folder.write("a b/data+1.bin", w.buffer + "more than byteLength");
  GltfWriter external = w;
  external.add("buffers", "{\"byteLength\":" + std::to_string(w.buffer.size()) +
                              R"(,"uri":"a%20b/data+1.bin"})");
  GltfWriter bare = w;  // a media type that tinygltf does not know
  bare.add("buffers", "{\"byteLength\":" + std::to_string(w.buffer.size()) +
                          ",\"uri\":\"data:;base64," + base64(w.buffer) + "\"}");
  for (const std::filesystem::path& file :
       {w.gltf(folder), w.glb(folder), external.gltf(folder, "external.gltf"),
        bare.gltf(folder, "bare.gltf")}) {
    SCOPED_TRACE(file.string());
    const Scene scene = loadGltf(file);
    ASSERT_EQ(scene.objects.size(), 1u);
    EXPECT_EQ(scene.objects[0].name, "n");
    EXPECT_EQ(scene.triangleCount(), 1u);
    EXPECT_EQ(scene.source, file);
    const Mesh& mesh = scene.meshes[0];
    EXPECT_THAT(mesh.indices, ElementsAre(0, 1, 2));
    EXPECT_THAT(mesh.positions, ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)));
    EXPECT_THAT(mesh.normals, ElementsAre(Vec3(0, 0, 1), Vec3(0, 0, 1), Vec3(0, 0, 1)));
  }
}

TEST_F(Gltf, EveryIndexType) {
  for (const int type : {5121, 5123, 5125}) {
    w = triangleFile();
    int view = 0;
    if (type == 5121) view = w.view(bytesOf(std::vector<std::uint8_t>{2, 0, 1}));
    if (type == 5123) view = w.view(bytesOf(std::vector<std::uint16_t>{2, 0, 1}));
    if (type == 5125) view = w.view(bytesOf(std::vector<std::uint32_t>{2, 0, 1}));
    w.accessor(view, type, "SCALAR", 3);
    w.arrays["meshes"] = {
        R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":3}]})"};
    EXPECT_THAT(load().meshes.at(0).indices, ElementsAre(2, 0, 1)) << type;
  }
}

TEST_F(Gltf, ModesMakeTheSpecifiedTriangles) {
  // glTF 2.0, section 3.7.2.1. Without normals each triangle has vertices of its own, so the
  // corners are seen through their x coordinate, which is the vertex' number.
  EXPECT_THAT(cornersOf(5, false), ElementsAre(0, 1, 2, 1, 3, 2, 2, 3, 4));
  EXPECT_THAT(cornersOf(6, false), ElementsAre(1, 2, 0, 2, 3, 0, 3, 4, 0));
  EXPECT_THAT(cornersOf(5, true), ElementsAre(4, 3, 2, 3, 1, 2, 2, 1, 0));
  EXPECT_THAT(cornersOf(6, true), ElementsAre(3, 2, 4, 2, 1, 4, 1, 0, 4));
}

TEST_F(Gltf, PointsAndLinesAreNoted) {
  for (const int mode : {0, 1, 2, 3}) {
    w = triangleFile();
    w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":0},"mode":)" +
                          std::to_string(mode) +
                          R"(},{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]})"};
    const Scene scene = load();
    EXPECT_EQ(scene.objects.size(), 1u);
    EXPECT_EQ(scene.objects[0].name, "n/1");
    EXPECT_TRUE(hasNote(scene, "/meshes/0/primitives/0: points and lines")) << mode;
  }
}

TEST_F(Gltf, InterleavedStride) {
  // position and normal alternate, 24 bytes apart
  w.accessor(
      w.view(bytesOf(std::vector<float>{0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 1, 0, 3, 0, 0, 0, 1}), 24),
      5126, "VEC3", 3);
  w.accessor(0, 5126, "VEC3", 3, R"("byteOffset":12)");
  w.add("meshes", R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]})");
  w.add("nodes", R"({"mesh":0})");
  const Scene scene = load();
  EXPECT_THAT(scene.meshes.at(0).positions,
              ElementsAre(Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 3, 0)));
  EXPECT_THAT(scene.meshes[0].normals, ElementsAre(Vec3(0, 0, 1), Vec3(0, 0, 1), Vec3(0, 0, 1)));
}

TEST_F(Gltf, SparseOverABufferViewAndAlone) {
  w = triangleFile();
  const int at = w.view(bytesOf(std::vector<std::uint8_t>{1, 2}));
  const int values = w.view(bytesOf(std::vector<float>{7, 8, 9, -1, -2, -3}));
  const std::string sparse =
      R"("sparse":{"count":2,"indices":{"bufferView":)" + std::to_string(at) +
      R"(,"componentType":5121},"values":{"bufferView":)" + std::to_string(values) + "}}";
  const int over = w.accessor(0, 5126, "VEC3", 3, sparse);
  const int alone = w.accessor(-1, 5126, "VEC3", 3, sparse);
  const int zero = w.accessor(-1, 5126, "VEC3", 3);
  for (const auto& [accessor, first] :
       {std::pair(over, Vec3(0.0f)), std::pair(alone, Vec3(0.0f))}) {
    w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":)" +
                          std::to_string(accessor) + R"(,"NORMAL":1}}]})"};
    EXPECT_THAT(load().meshes.at(0).positions, ElementsAre(first, Vec3(7, 8, 9), Vec3(-1, -2, -3)));
  }
  // Without buffer view and sparse values all is zero; a degenerate triangle stays a triangle.
  w.arrays["meshes"] = {R"({"primitives":[{"attributes":{"POSITION":)" + std::to_string(zero) +
                        "}}]}"};
  Scene scene = load();
  finishScene(scene);
  EXPECT_EQ(scene.triangleCount(), 1u);
  for (const Vec3& n : scene.meshes.at(0).normals) EXPECT_NEAR(glm::length(n), 1.0f, 1e-6f);
}

TEST_F(Gltf, QuantizedAttributesAndNormalizedIntegers) {
  w.members["extensionsUsed"] = w.members["extensionsRequired"] = R"(["KHR_mesh_quantization"])";
  const int positions = w.accessor(
      w.view(bytesOf(std::vector<std::int16_t>{0, 0, 0, 0, 32767, -32768, 0, 0, 0, 300, 0, 0}), 8),
      5122, "VEC3", 3, R"("normalized":true)");
  const int plain = w.accessor(
      w.view(bytesOf(std::vector<std::int8_t>{0, 0, 0, 0, 100, -128, 5, 0, 1, 2, 3, 0}), 4), 5120,
      "VEC3", 3);
  const int normals = w.accessor(
      w.view(bytesOf(std::vector<std::int8_t>{0, 0, 127, 0, 0, 127, 0, 0, -128, 0, 0, 0}), 4), 5120,
      "VEC3", 3, R"("normalized":true)");
  const int uv8 = w.accessor(
      w.view(bytesOf(std::vector<std::uint8_t>{0, 255, 0, 0, 51, 102, 0, 0, 255, 0, 0, 0}), 4),
      5121, "VEC2", 3, R"("normalized":true)");
  const int uv16 =
      w.accessor(w.view(bytesOf(std::vector<std::uint16_t>{0, 65535, 13107, 26214, 65535, 0}), 4),
                 5123, "VEC2", 3, R"("normalized":true)");
  const int color = w.accessor(
      w.view(bytesOf(std::vector<std::uint8_t>{255, 0, 51, 255, 0, 0, 0, 255, 102, 0, 0, 255})),
      5121, "VEC4", 3, R"("normalized":true)");
  const auto mesh = [&](int position) {
    return R"({"primitives":[{"attributes":{"POSITION":)" + std::to_string(position) +
           ",\"NORMAL\":" + std::to_string(normals) + ",\"TEXCOORD_0\":" + std::to_string(uv8) +
           ",\"TEXCOORD_1\":" + std::to_string(uv16) + ",\"COLOR_0\":" + std::to_string(color) +
           "}}]}";
  };
  w.add("meshes", mesh(positions));
  w.add("meshes", mesh(plain));
  w.add("nodes", R"({"mesh":0})");
  w.add("nodes", R"({"mesh":1})");
  Scene scene = load();
  finishScene(scene);
  const Mesh& a = scene.meshes.at(0);
  EXPECT_THAT(a.positions, ElementsAre(Vec3(0.0f), Vec3(1, -1, 0), Vec3(0, 300.0f / 32767.0f, 0)));
  EXPECT_THAT(scene.meshes.at(1).positions,
              ElementsAre(Vec3(0.0f), Vec3(100, -128, 5), Vec3(1, 2, 3)));
  EXPECT_EQ(a.normals[0], Vec3(0, 0, 1));
  EXPECT_EQ(a.normals[1], Vec3(0, 1, 0));
  EXPECT_NEAR(glm::length(a.normals[2]), 1.0f, 1e-6f);
  for (const auto& uv : a.uv) {
    EXPECT_EQ(uv[0], Vec2(0, 1));
    EXPECT_NEAR(uv[1].x, 0.2f, 1e-6f);
    EXPECT_NEAR(uv[1].y, 0.4f, 1e-6f);
    EXPECT_EQ(uv[2], Vec2(1, 0));
  }
  expectNear(a.colors[0], Vec3(1.0f, 0.0f, 0.2f));
  expectNear(a.colors[2], Vec3(0.4f, 0.0f, 0.0f));
}

TEST_F(Gltf, MissingNormalsAreFlat) {
  // Two triangles of a tent share an edge; each keeps its own normal.
  w.floats({-1, 0, 0, 0, 1, 0, 0, 1, 1, 1, 0, 0}, "VEC3");
  const int indices = w.indices({0, 2, 1, 1, 2, 3});
  w.add("meshes", R"({"primitives":[{"attributes":{"POSITION":0},"indices":)" +
                      std::to_string(indices) + "}]}");
  w.add("nodes", R"({"mesh":0})");
  Scene scene = load();
  finishScene(scene);
  const Mesh& mesh = scene.meshes.at(0);
  ASSERT_EQ(mesh.positions.size(), 6u);
  const float h = std::sqrt(0.5f);
  for (std::size_t i = 0; i < 3; ++i) {
    expectNear(mesh.normals[i], Vec3(-h, h, 0));
    expectNear(mesh.normals[i + 3], Vec3(h, h, 0));
  }
}

TEST_F(Gltf, UnusedVerticesAreDropped) {
  w.floats({9, 9, 9, 0, 0, 0, 8, 8, 8, 1, 0, 0, 0, 1, 0}, "VEC3");
  w.floats({1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 1}, "VEC3");
  w.indices({4, 1, 3});
  w.add("meshes", R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]})");
  w.add("nodes", R"({"mesh":0})");
  const Mesh mesh = load().meshes.at(0);
  EXPECT_THAT(mesh.positions, ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)));
  EXPECT_THAT(mesh.indices, ElementsAre(2, 0, 1));
}

TEST_F(Gltf, HierarchyOfMatrixAndTrs) {
  w = triangleFile();
  // Stored child first: the loader puts parents before children.
  w.arrays["nodes"] = {
      R"({"name":"child","mesh":0,"translation":[1,2,3],"rotation":[0,0,0.70710678,0.70710678],"scale":[2,3,4]})",
      R"({"name":"root","children":[0],"matrix":[0,0,-1,0, 0,1,0,0, 1,0,0,0, 10,20,30,1]})"};
  w.arrays["scenes"] = {R"({"nodes":[1]})"};
  const Scene scene = load();
  ASSERT_EQ(scene.nodes.size(), 2u);
  EXPECT_EQ(scene.nodes[0].name, "root");
  EXPECT_EQ(scene.nodes[1].parent, 0);
  // (1,0,0) is scaled to (2,0,0), turned to (0,2,0), moved to (1,4,3), turned by the root about
  // +y by 90 degrees (x to -z, z to x) to (3,4,-1), and moved.
  const std::vector<Vec3> p = worldPositions(scene);
  expectNear(p[0], Vec3(13, 22, 29), 1e-5f);
  expectNear(p[1], Vec3(13, 24, 29), 1e-5f);
  expectNear(p[2], Vec3(13, 22, 32), 1e-5f);
  // Normal +z: scaled by the inverse transpose it stays; the root turns it to +x.
  expectNear(worldVertices(scene, scene.objects[0], poseAt(scene, 0)).normals[0], Vec3(1, 0, 0));
}

TEST_F(Gltf, ChildrenAmongASceneRootsAreDrawnOnceBelowTheirParents) {
  w = triangleFile();
  w.arrays["nodes"] = {R"({"mesh":0})", R"({"children":[0],"translation":[5,0,0]})"};
  for (const char* roots : {R"({"nodes":[0,1]})", R"({"nodes":[1,0]})", R"({"nodes":[0]})"}) {
    w.arrays["scenes"] = {roots};
    const Scene scene = load();
    ASSERT_EQ(scene.objects.size(), 1u) << roots;
    EXPECT_EQ(worldPositions(scene)[0], Vec3(5, 0, 0));
    EXPECT_THAT(scene.warnings, ElementsAre(HasSubstr("node 0 is not a root but child of 1")));
  }
}

TEST_F(Gltf, MirroringFlipsTheWindingAndKeepsNormalsOutside) {
  w = triangleFile();
  w.arrays["nodes"] = {R"({"mesh":0,"scale":[1,1,-1]})"};
  const Scene scene = load();
  const WorldVertices v = worldVertices(scene, scene.objects[0], poseAt(scene, 0));
  EXPECT_TRUE(v.flipWinding);
  expectNear(v.normals[0], Vec3(0, 0, -1));
  w.arrays["nodes"] = {R"({"mesh":0,"scale":[-1,1,-1]})"};
  const Scene twice = load();
  EXPECT_FALSE(worldVertices(twice, twice.objects[0], poseAt(twice, 0)).flipWinding);
}

TEST_F(Gltf, InstancesAreObjects) {
  w = triangleFile();
  w.members["extensionsUsed"] = R"(["EXT_mesh_gpu_instancing"])";
  const int t = w.floats({0, 0, 0, 5, 6, 7}, "VEC3");
  const int r =
      w.accessor(w.view(bytesOf(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 32767, 0})), 5122,
                 "VEC4", 2, R"("normalized":true)");
  const int s = w.floats({1, 1, 1, 2, 2, 2}, "VEC3");
  w.arrays["nodes"] = {
      R"({"name":"leaf","mesh":0,"translation":[100,0,0],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":)" +
      std::to_string(t) + ",\"ROTATION\":" + std::to_string(r) + ",\"SCALE\":" + std::to_string(s) +
      "}}}}"};
  const Scene scene = load();
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.triangleCount(), 2u);
  EXPECT_EQ(scene.objects[1].name, "leaf#1");
  // A half turn about +z, twice the size.
  expectNear(worldPositions(scene, 0)[1], Vec3(101, 0, 0));
  expectNear(worldPositions(scene, 1)[1], Vec3(103, 6, 7), 1e-5f);
  expectNear(worldPositions(scene, 1)[2], Vec3(105, 4, 7), 1e-5f);
}

TEST_F(Gltf, OnlyTheDefaultSceneIsDrawn) {
  w = triangleFile();
  w.arrays["nodes"] = {R"({"name":"a","mesh":0})", R"({"name":"b","mesh":0})"};
  w.arrays["scenes"] = {R"({"nodes":[0]})", R"({"nodes":[1]})"};
  w.members["scene"] = "1";
  const Scene scene = load();
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].name, "b");
  EXPECT_TRUE(hasNote(scene, "of 2 scenes, scene 1 is loaded"));
}

TEST_F(Gltf, LightsAndCameras) {
  w = triangleFile();
  w.members["extensions"] =
      R"({"KHR_lights_punctual":{"lights":[{"type":"spot","color":[1,0.5,0],"intensity":10,"range":7,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.2}},{"type":"directional","name":"sun"},{"type":"point","intensity":3,"extras":{"catoptric":{"radius":0.25,"baked":true}}}]}})";
  w.arrays["nodes"] = {
      R"({"mesh":0,"children":[1,2,3,4]})",
      R"({"name":"l0","translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":0}}})",
      R"({"extensions":{"KHR_lights_punctual":{"light":1}}})",
      R"({"extensions":{"KHR_lights_punctual":{"light":2}}})", R"({"name":"eye","camera":1})"};
  w.arrays["scenes"] = {R"({"nodes":[0]})"};
  w.add("cameras",
        R"({"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0,"zfar":1}})");
  w.add("cameras", R"({"type":"perspective","perspective":{"yfov":0.75,"znear":1e-5}})");
  const Scene scene = load();
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0].type, LightType::Spot);
  EXPECT_EQ(scene.lights[0].name, "l0");
  expectNear(scene.lights[0].intensity, Vec3(10, 5, 0));
  EXPECT_FLOAT_EQ(scene.lights[0].range, 7.0f);
  EXPECT_FLOAT_EQ(scene.lights[0].innerConeRad, 0.1f);
  EXPECT_FLOAT_EQ(scene.lights[0].outerConeRad, 0.2f);
  EXPECT_EQ(scene.lights[0].node, 1);
  EXPECT_EQ(scene.lights[1].type, LightType::Directional);
  EXPECT_EQ(scene.lights[1].name, "sun");
  EXPECT_EQ(scene.lights[1].direction, Vec3(0, 0, -1));
  EXPECT_FLOAT_EQ(scene.lights[2].radius, 0.25f);
  EXPECT_TRUE(scene.lights[2].baked);
  EXPECT_FALSE(scene.lights[1].baked);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "eye");
  EXPECT_EQ(scene.cameras[0].node, 4);
  EXPECT_FLOAT_EQ(scene.cameras[0].verticalFovRad, 0.75f);
  EXPECT_FLOAT_EQ(scene.cameras[0].nearMetres, 1e-5f);
}

TEST_F(Gltf, CamerasKeepTheirNearPlaneAndHaveNoFarPlane) {
  const auto loadWith = [&](const std::string& camera) {
    w = triangleFile();
    w.arrays["nodes"] = {R"({"mesh":0})", R"({"name":"eye","camera":0})"};
    w.arrays["scenes"] = {R"({"nodes":[0,1]})"};
    w.add("cameras", camera);
    return load();
  };
  const Scene infinite =
      loadWith(R"({"type":"perspective","perspective":{"yfov":0.75,"znear":0.25}})");
  ASSERT_EQ(infinite.cameras.size(), 1u);
  EXPECT_FLOAT_EQ(cameraPath("", infinite)->frame(1).camera.nearMetres, 0.25f);
  const Scene far =
      loadWith(R"({"type":"perspective","perspective":{"yfov":0.75,"znear":0.25,"zfar":0.5}})");
  EXPECT_EQ(cameraPath("", far)->frame(1).camera, cameraPath("", infinite)->frame(1).camera);
  const Scene orthographic = loadWith(
      R"({"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0.25,"zfar":1}})");
  EXPECT_TRUE(orthographic.cameras.empty());
  EXPECT_TRUE(hasNote(orthographic, "orthographic cameras are ignored"));
}

TEST_F(Gltf, TwentyThousandNodesDeepAreFine) {
  w = triangleFile();
  w.arrays["nodes"].clear();
  constexpr int kDepth = 20000;
  for (int i = 0; i < kDepth; ++i) {
    w.add("nodes", R"({"translation":[0,0,0.5],"children":[)" + std::to_string(i + 1) + "]}");
  }
  w.add("nodes", R"({"mesh":0})");
  const Scene scene = load();
  EXPECT_EQ(worldPositions(scene)[0], Vec3(0, 0, kDepth / 2));
}

TEST_F(Gltf, SameFileSameFingerprintAndEveryPartCounts) {
  w = triangleFile();
  w.arrays["meshes"] = {
      R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]})"};
  w.arrays["materials"] = {"{}"};
  const auto print = [&](const GltfWriter& file) {
    return loadScene(file.gltf(folder)).fingerprint;
  };
  const std::uint64_t base = print(w);
  EXPECT_EQ(print(w), base);
  EXPECT_EQ(loadScene(w.glb(folder)).fingerprint, base);
  GltfWriter changed = w;
  changed.buffer[3] = '\x3e';  // a position
  EXPECT_NE(print(changed), base);
  changed = w;
  changed.arrays["materials"] = {R"({"pbrMetallicRoughness":{"roughnessFactor":0.5}})"};
  EXPECT_NE(print(changed), base);
  changed = w;
  changed.arrays["nodes"] = {R"({"mesh":0,"translation":[0,0,1]})"};
  EXPECT_NE(print(changed), base);
  changed = w;
  changed.arrays["nodes"] = {R"({"mesh":0,"name":"another"})"};
  EXPECT_NE(print(changed), base);  // by its name a config gives an object to a method
}

/// JSON with every integer outside of texts as a float: 36 as 36.0, and 5126 as 5126e0.
std::string withFloats(const std::string& json) {
  std::string text;
  bool inText = false;
  bool odd = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '"') inText = !inText;
    text += json[i];
    const auto isDigit = [&](std::size_t at) {
      return at < json.size() && (std::isdigit(static_cast<unsigned char>(json[at])) != 0 ||
                                  json[at] == '.' || json[at] == 'e');
    };
    const bool isNumber = std::isdigit(static_cast<unsigned char>(json[i])) != 0;
    if (!inText && isNumber && !isDigit(i + 1)) text += (odd = !odd) ? ".0" : "e0";
  }
  return text;
}

TEST_F(Gltf, IntegersMayBeWrittenAsFloats) {
  w = triangleFile();
  w.members["scene"] = "0";
  w.add("nodes", R"({"translation":[0,0,2],"children":[2],"mesh":0})");
  w.add("nodes", R"({"name":"child","mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}})");
  w.arrays["scenes"] = {R"({"nodes":[0,1]})"};
  w.add("materials", R"({"emissiveFactor":[1,1,1],"doubleSided":true})");
  w.arrays["meshes"] = {
      R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]})"};
  w.members["extensionsUsed"] = R"(["KHR_lights_punctual"])";
  w.members["extensions"] =
      R"({"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3}]}})";
  const Scene plain = load();
  ASSERT_EQ(plain.objects.size(), 3u);

  const auto expectSame = [&](const Scene& scene) {
    ASSERT_EQ(scene.objects.size(), 3u);
    ASSERT_EQ(scene.meshes.size(), plain.meshes.size());
    EXPECT_EQ(scene.meshes[0].indices, plain.meshes[0].indices);
    ASSERT_EQ(scene.lights.size(), 1u);
    for (std::size_t o = 0; o < 3; ++o) {
      EXPECT_EQ(scene.objects[o].name, plain.objects[o].name);
      EXPECT_EQ(scene.objects[o].material, plain.objects[o].material);
      const std::vector<Vec3> positions = worldPositions(scene, o);
      EXPECT_EQ(positions, worldPositions(plain, o)) << o;
    }
  };
  expectSame(loadGltf(folder.write("floats.gltf", withFloats(w.json(true)))));
  expectSame(loadGltf(
      folder.write("floats.glb", GltfWriter::glbBytes(withFloats(w.json(false)), w.buffer))));
  // Zeros may pad the JSON of a GLB file
  std::string padded = w.json(false);
  padded.append(4 - padded.size() % 4, '\0');
  expectSame(loadGltf(folder.write("padded.glb", GltfWriter::glbBytes(padded, w.buffer))));
}

TEST_F(Gltf, LargeIntegersOfExtensionsDoNotWrap) {
  const Material m = materialOf(
      R"({"emissiveFactor":[1,1,1],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":3000000000}}})");
  expectNear(m.emissive, Vec3(3e9f), 1.0f);
  w = triangleFile();
  w.add("materials", R"({"extras":{"catoptric":{"s":1,"n":5000000000}}})");
  w.arrays["meshes"] = {
      R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]})"};
  EXPECT_LT(load().materials[0].roughness, 1e-3f);
}

TEST_F(Gltf, FilesAreAlsoLookedForInAssetFolders) {
  w = triangleFile();
  const std::string bytes = w.buffer;
  const auto file = [&](const std::string& uri) {
    w.arrays["buffers"] = {R"({"byteLength":)" + std::to_string(bytes.size()) + R"(,"uri":")" +
                           uri + "\"}"};
    return w.gltf(folder);
  };
  const TemporaryFolder first;
  const TemporaryFolder second;
  std::filesystem::create_directory(second.path() / "parts");
  second.write("parts/a.bin", bytes);
  const LoadLimits limits{.assetFolders = {first.path(), second.path()}};
  const auto scene = file("parts/a.bin");
  try {
    loadGltf(scene);
    ADD_FAILURE() << "loaded";
  } catch (const SceneError& e) {
    EXPECT_THAT(e.what(), HasSubstr("--asset-path"));
  }
  EXPECT_EQ(loadGltf(scene, limits).objects.size(), 1u);

  // The scene's own folder comes first, then the folders in their order; the fingerprint tells them
  const auto printOf = [&](const std::filesystem::path& gltf) {
    Scene loaded = loadGltf(gltf, limits);
    finishScene(loaded);
    return loaded.fingerprint;
  };
  const auto before = printOf(scene);
  w.buffer[0] = 1;
  std::filesystem::create_directory(first.path() / "parts");
  first.write("parts/a.bin", w.buffer);
  EXPECT_NE(printOf(scene), before);
  std::filesystem::create_directory(folder.path() / "parts");
  folder.write("parts/a.bin", bytes);
  EXPECT_EQ(printOf(scene), before);

  // Names that lead out of the scene's folder must lead into one of the others
  const std::string up = "../" + second.path().filename().string() + "/parts/a.bin";
  EXPECT_EQ(loadGltf(file(up), limits).objects.size(), 1u);
  EXPECT_THROW(loadGltf(file(up)), SceneError);
  EXPECT_THROW(loadGltf(file(up), {.assetFolders = {first.path()}}), SceneError);
}

}  // namespace
}  // namespace catoptric::scene
