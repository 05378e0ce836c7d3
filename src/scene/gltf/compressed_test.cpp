// A torus that other programs compressed (testdata/make_compressed.mjs), whose vertices and
// triangles are known, and damaged copies of the same files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "scene/gltf/test_fixture.h"

namespace catoptric::scene {
namespace {

using namespace catoptric::scene::testing;
using ::testing::HasSubstr;

constexpr int kAround = 24;
constexpr int kAlong = 12;

std::filesystem::path sample(const std::string& name) {
  return std::filesystem::path(CATOPTRIC_SOURCE_DIR) / "src/scene/gltf/testdata" / name;
}

Vec3 normalAt(int i, int j) {
  const double a = 2.0 * std::numbers::pi * i / kAround;
  const double b = 2.0 * std::numbers::pi * j / kAlong;
  return {std::cos(b) * std::cos(a), std::sin(b), std::cos(b) * std::sin(a)};
}
Vec3 positionAt(int i, int j) {
  const double a = 2.0 * std::numbers::pi * i / kAround;
  return Vec3(std::cos(a), 0.0, std::sin(a)) + 0.4f * normalAt(i, j);
}

/// What quantization may change.
struct Steps {
  float position = 0.0f;
  float normal = 0.0f;
};

/// Compares the file's torus with the known one, as it is turned at the time `turn`.
void expectTorus(const Scene& scene, const Steps& steps, double time) {
  ASSERT_EQ(scene.objects.size(), 1u);
  const Mesh& mesh = scene.meshes[static_cast<std::size_t>(scene.objects[0].mesh)];
  const auto world = worldVertices(scene, scene.objects[0], poseAt(scene, time));
  ASSERT_EQ(mesh.positions.size(), std::size_t{(kAround + 1) * (kAlong + 1)});
  const auto turned = [&](const Vec3& p) {
    const double angle = 0.5 * std::numbers::pi * time;
    const auto c = static_cast<float>(std::cos(angle));
    const auto s = static_cast<float>(std::sin(angle));
    return Vec3(c * p.x + s * p.z, p.y, c * p.z - s * p.x);
  };
  std::vector<int> cornerOf(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec2 uv = mesh.uv[0].at(v);
    const int i = static_cast<int>(std::lround(uv.x * kAround));
    const int j = static_cast<int>(std::lround(uv.y * kAlong));
    EXPECT_NEAR(uv.x, static_cast<float>(i) / kAround, 1.0f / 4095) << v;
    EXPECT_NEAR(uv.y, static_cast<float>(j) / kAlong, 1.0f / 4095) << v;
    cornerOf[v] = i * (kAlong + 1) + j;
    expectNear(world.positions[v], turned(positionAt(i, j)), steps.position);
    expectNear(glm::normalize(world.normals[v]), turned(normalAt(i, j)), steps.normal);
  }
  // Each triangle once, whatever its first corner
  const auto rotated = [](int a, int b, int c) {
    while (a > b || a > c) std::tie(a, b, c) = std::make_tuple(b, c, a);
    return std::array{a, b, c};
  };
  std::multiset<std::array<int, 3>> known;
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAlong; ++j) {
      const int p = i * (kAlong + 1) + j;
      const int q = p + kAlong + 1;
      known.insert(rotated(p, p + 1, q));
      known.insert(rotated(q, p + 1, q + 1));
    }
  }
  std::multiset<std::array<int, 3>> read;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3)
    read.insert(rotated(cornerOf[mesh.indices[t]], cornerOf[mesh.indices[t + 1]],
                        cornerOf[mesh.indices[t + 2]]));
  EXPECT_EQ(read, known);
}

/// Half a step of 14 bits over the torus, and what floats round.
constexpr float kHalfStep = 0.51f * 2.8f / 16383;
/// Its turn has 12 bits.
constexpr float kTurn = 1.4f * 2.0f / 4095;

TEST(GltfCompressed, MeshoptTorus) {
  const Scene scene = loadGltf(sample("meshopt.glb"));
  expectTorus(scene, {kHalfStep, 2.0f / 127}, 0.0);
  expectTorus(scene, {kHalfStep + kTurn, 2.0f / 127}, 0.5);
  expectTorus(scene, {kHalfStep + kTurn, 2.0f / 127}, 1.0);
}

TEST(GltfCompressed, MeshoptFloatsTorus) {
  const Scene scene = loadGltf(sample("meshopt_floats.glb"));
  expectTorus(scene, {kHalfStep, 2.0f / 127}, 0.0);
  expectTorus(scene, {kHalfStep + kTurn, 2.0f / 127}, 1.0);
}

TEST(GltfCompressed, DracoTorus) {
  for (const char* name : {"draco.glb", "draco_sequential.glb"}) {
    SCOPED_TRACE(name);
    const Scene scene = loadGltf(sample(name));
    expectTorus(scene, {kHalfStep, 2.0f / 1023}, 0.0);
    expectTorus(scene, {kHalfStep, 2.0f / 1023}, 1.0);
  }
}

/// A change to a file, and what the error must say.
struct Damaged {
  const char* file;
  std::string from;  ///< text of the JSON part, its first occurrence
  std::string to;
  std::string place;
  std::string message;
};

std::filesystem::path writeDamaged(const TemporaryFolder& folder, const Damaged& c) {
  const std::vector<std::byte> bytes = readFile(sample(c.file));
  std::string glb(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, sizeof length);
  std::string json = glb.substr(20, length);
  std::string data = glb.substr(28 + length);
  std::string& part = json.find(c.from) != std::string::npos ? json : data;
  const std::size_t at = part.find(c.from);
  EXPECT_NE(at, std::string::npos) << c.from;
  if (at != std::string::npos) part.replace(at, c.from.size(), c.to);
  return folder.write("damaged.glb", GltfWriter::glbBytes(json, data));
}

std::string errorOfDamaged(const Damaged& c) {
  const TemporaryFolder folder;
  const std::filesystem::path file = writeDamaged(folder, c);
  try {
    loadGltf(file);
  } catch (const SceneError& e) {
    return e.what();
  }
  return "(loaded)";
}

void expectErrors(const std::vector<Damaged>& all) {
  for (const Damaged& c : all) {
    SCOPED_TRACE(c.from + " -> " + c.to);
    const std::string error = errorOfDamaged(c);
    EXPECT_THAT(error, HasSubstr("damaged.glb: " + c.place + ": "));
    EXPECT_THAT(error, HasSubstr(c.message));
  }
}

TEST(GltfCompressed, DamagedMeshopt) {
  const std::string own = "/bufferViews/0/extensions/EXT_meshopt_compression";
  expectErrors({
      {"meshopt.glb", "\"byteLength\":1570", "\"byteLength\":400", own,
       "the 400 bytes do not hold 325 elements of the mode ATTRIBUTES"},
      {"meshopt.glb", "\"byteLength\":1570", "\"byteLength\":91570", own, "reaches past the end"},
      {"meshopt.glb", "\"count\":325", "\"count\":326", own, "count 326 and byteStride 8"},
      {"meshopt.glb", "\"byteStride\":8,\"mode\":\"ATTRIBUTES\"",
       "\"byteStride\":6,\"mode\":\"ATTRIBUTES\"", own + "/byteStride", "a multiple of 4"},
      {"meshopt.glb", "ATTRIBUTES", "TRIANGLES", own + "/byteStride",
       "8 is not allowed with mode TRIANGLES: 2 or 4"},
      {"meshopt.glb", "ATTRIBUTES", "POINTS", own + "/mode", "\"POINTS\" is not one of"},
      {"meshopt.glb", "OCTAHEDRAL", "QUATERNION",
       "/bufferViews/1/extensions/EXT_meshopt_compression/byteStride",
       "4 is not allowed with mode ATTRIBUTES and filter QUATERNION: 8"},
      {"meshopt.glb", "EXT_meshopt_compression\":{\"buffer\":0", "EXT_none\":{\"buffer\":0",
       "/bufferViews/0/buffer", "/buffers/1 has no bytes"},
      {"meshopt.glb", "{\"buffer\":0", "{\"buffer\":1", own + "/buffer", "/buffers/1 has no bytes"},
  });
}

TEST(GltfCompressed, DamagedDraco) {
  const std::string primitive = "/meshes/0/primitives/0";
  const std::string own = primitive + "/extensions/KHR_draco_mesh_compression";
  const std::string header("DRACO\2\2", 7);
  expectErrors({
      {"draco.glb", header, std::string("DRACO\1\1", 7), own, "bitstream version 1.1"},
      {"draco.glb", header, std::string("DRAGO\2\2", 7), own, "their header is damaged"},
      {"draco.glb", "\"count\":1728", "\"count\":1731", primitive + "/indices",
       "has 1731 elements, the Draco mesh 1728"},
      {"draco.glb", "\"count\":325", "\"count\":324", own + "/attributes/POSITION",
       "has 324 elements, the Draco mesh 325 points"},
      {"draco.glb", "{\"POSITION\":0", "{\"POSITION\":9", own + "/attributes/POSITION",
       "has no attribute 9"},
      {"draco.glb", "{\"POSITION\":0", "{\"POSITION\":2", own + "/attributes/POSITION",
       "has 3 components, the Draco mesh 2"},
      {"draco.glb", "{\"POSITION\":0", "{\"COLOR_0\":0", own + "/attributes/COLOR_0",
       "is not among the primitive's attributes"},
      {"draco.glb", "\"mode\":4", "\"mode\":5", primitive + "/mode", "must be 4"},
      {"draco.glb", "\"indices\":0,", "", primitive, "\"indices\" is missing"},
  });
}

TEST(GltfCompressed, PrimitivesOfOneBufferViewDecodeItOnce) {
  const std::string accessors = R"({"attributes":{"POSITION":1,"NORMAL":2,"TEXCOORD_0":3},)";
  const std::string ids =
      R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":1,"attributes":{)";
  const auto primitive = [&](const std::string& indices, const std::string& position) {
    return accessors + R"("mode":4,"material":0,"indices":)" + indices + ids + R"("POSITION":)" +
           position + R"(,"NORMAL":1,"TEXCOORD_0":2}}}})";
  };
  const std::string one = primitive("0", "0");
  std::string many = one;
  constexpr std::size_t kPrimitives = 64;
  for (std::size_t i = 1; i < kPrimitives; ++i) many += "," + one;
  const TemporaryFolder folder;
  LoadLimits limits;
  limits.maxBytes = std::size_t{2} << 20;  // 64 decoded meshes would take 3.5 MB
  const Scene scene = loadGltf(writeDamaged(folder, {"draco.glb", one, many, "", ""}), limits);
  ASSERT_EQ(scene.meshes.size(), kPrimitives);
  for (const Mesh& mesh : scene.meshes) {
    EXPECT_EQ(mesh.indices.size(), std::size_t{1728});
    EXPECT_EQ(mesh.positions, scene.meshes[0].positions);
    EXPECT_EQ(mesh.indices, scene.meshes[0].indices);
  }
  const std::string second = "/meshes/0/primitives/1";
  expectErrors({
      {"draco.glb", one, one + "," + primitive("4", "0"), second + "/indices",
       "has 2 elements, the Draco mesh 1728"},
      {"draco.glb", one, one + "," + primitive("0", "1"),
       second + "/extensions/KHR_draco_mesh_compression/attributes/POSITION",
       "would have the values of two attributes"},
  });
}

TEST(GltfCompressed, DracoThatEndsEarlyIsRefused) {
  for (int length = 1; length < 2000; length += 37) {
    const std::string error = errorOfDamaged(
        {"draco.glb", "\"byteOffset\":40,\"byteLength\":",
         "\"byteOffset\":40,\"byteLength\":" + std::to_string(length) + ",\"was\":", "", ""});
    EXPECT_THAT(error, HasSubstr("/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression"))
        << length;
  }
}

}  // namespace
}  // namespace catoptric::scene
