// Bad files: each is refused with a SceneError that names the file, the place and the reason.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>

#include "core/error.h"
#include "scene/gltf/test_writer.h"
#include "scene/loader.h"

namespace catoptric::scene {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using namespace catoptric::scene::testing;

std::string errorOf(const std::filesystem::path& file, const LoadLimits& limits = {}) {
  try {
    loadGltf(file, limits);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::Scene) << e.what();
    return e.what();
  }
  return "(loaded)";
}

/// A change to the good triangle file, and what the error must say.
struct Bad {
  std::string name;
  std::string place;
  std::string message;
  std::function<void(GltfWriter&)> change;
};

void primitive(GltfWriter& w, const std::string& json) {
  w.arrays["meshes"] = {R"({"primitives":[)" + json + "]}"};
}

std::string animation(const std::string& path, int input, int output,
                      const std::string& interpolation = "LINEAR") {
  return R"({"samplers":[{"input":)" + std::to_string(input) +
         ",\"output\":" + std::to_string(output) + ",\"interpolation\":\"" + interpolation +
         R"("}],"channels":[{"sampler":0,"target":{"node":0,"path":")" + path + "\"}}]}";
}

/// Syntax and types.
std::vector<Bad> badSyntax() {
  return {
      {"Syntax", "", "", [](GltfWriter& w) { w.members["x"] = "["; }},
      {"DuplicateKey", "", "",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":0,"mesh":0})"}; }},
      {"DeepJson", "byte", "nested deeper",
       [](GltfWriter& w) {
         w.members["extras"] = std::string(20000, '[') + std::string(20000, ']');
       }},
      {"NoVersion", "/asset/version", "missing",
       [](GltfWriter& w) { w.members["asset"] = R"({"generator":"x"})"; }},
      {"OldVersion", "/asset/version", "\"1.0\" is not supported",
       [](GltfWriter& w) { w.members["asset"] = R"({"version":"1.0"})"; }},
      {"MinVersion", "/asset/minVersion", "\"2.1\" is not supported",
       [](GltfWriter& w) { w.members["asset"] = R"({"version":"2.1","minVersion":"2.1"})"; }},
      {"MinVersionIsNumber", "/asset/minVersion", "must be a string, is a number",
       [](GltfWriter& w) { w.members["asset"] = R"({"version":"2.0","minVersion":2.0})"; }},
      {"TextAfterZero", "", "is zero, which is not allowed",
       [](GltfWriter& w) { w.members["extras"] = std::string("1}\0{", 4); }},
      {"ZeroInName", "", "/nodes/0/name: the character \\u0000 is not allowed",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"name":"a\u0000b","mesh":0})"}; }},
      {"RequiredExtension", "/extensionsRequired/0", "\"KHR_materials_volume\" is required",
       [](GltfWriter& w) { w.members["extensionsRequired"] = R"(["KHR_materials_volume"])"; }},
      {"MeshIsString", "/nodes/0/mesh", "must be a number, is a string",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":"0"})"}; }},
      {"NodesIsObject", "/nodes", "must be an array",
       [](GltfWriter& w) {
         w.arrays.erase("nodes");
         w.members["nodes"] = "{}";
       }},
      {"FractionalIndex", "/nodes/0/mesh", "0.5 is not an integer",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":0.5})"}; }},
      {"WrappingIndex", "/nodes/0/mesh", "index 4.2949673e+09 is out of range",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":4294967296})"}; }},
      {"NegativeIndex", "/nodes/0/mesh", "index -1 is out of range",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":-1})"}; }},
  };
}

/// Indices of everything.
std::vector<Bad> badIndices() {
  return {
      {"NoSuchMesh", "/nodes/0/mesh", "the file has 1 meshes",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":1})"}; }},
      {"NoSuchAccessor", "/meshes/0/primitives/1/attributes/POSITION", "index 9 is out of range",
       [](GltfWriter& w) {
         primitive(w, R"({"attributes":{"POSITION":0}},{"attributes":{"POSITION":9}})");
       }},
      {"NoSuchMaterial", "/meshes/0/primitives/0/material", "the file has 0 materials",
       [](GltfWriter& w) { primitive(w, R"({"attributes":{"POSITION":0},"material":0})"); }},
      {"NoSuchSkin", "/nodes/0/skin", "out of range",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"mesh":0,"skin":0})"}; }},
      {"NoSuchScene", "/scene", "the file has 1 scenes",
       [](GltfWriter& w) { w.members["scene"] = "1"; }},
      {"NoSuchLight", "/nodes/0/extensions/KHR_lights_punctual/light", "the file has 0 lights",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {R"({"extensions":{"KHR_lights_punctual":{"light":0}}})"};
       }},
      {"NoSuchTexture", "/materials/0/normalTexture/index", "out of range",
       [](GltfWriter& w) { w.add("materials", R"({"normalTexture":{"index":3}})"); }},
      {"NoSuchBuffer", "/bufferViews/0/buffer", "the file has 1 buffers",
       [](GltfWriter& w) { w.arrays["bufferViews"][0] = R"({"buffer":1,"byteLength":36})"; }},
      {"NoSuchSampler", "/animations/0/channels/0/sampler", "the animation has 1 samplers",
       [](GltfWriter& w) {
         w.add("animations", R"({"samplers":[{"input":0,"output":0}],)"
                             R"("channels":[{"sampler":1,"target":{"node":0,"path":"scale"}}]})");
       }},
  };
}

/// Accessors: counts, places.
std::vector<Bad> badAccessors() {
  return {
      {"IndexOutOfRange", "/meshes/0/primitives/0/indices",
       "index 3 at 1 is out of range: the primitive has 3 vertices",
       [](GltfWriter& w) {
         const int i = w.indices({0, 3, 1});
         primitive(w, R"({"attributes":{"POSITION":0},"indices":)" + std::to_string(i) + "}");
       }},
      {"PartialTriangle", "/meshes/0/primitives/0/indices", "4 vertices are not a multiple of 3",
       [](GltfWriter& w) {
         const int i = w.indices({0, 1, 2, 0});
         primitive(w, R"({"attributes":{"POSITION":0},"indices":)" + std::to_string(i) + "}");
       }},
      {"UnequalCounts", "/meshes/0/primitives/0/attributes/NORMAL", "2 elements, POSITION has 3",
       [](GltfWriter& w) {
         const int n = w.floats({0, 0, 1, 0, 0, 1}, "VEC3");
         primitive(w, R"({"attributes":{"POSITION":0,"NORMAL":)" + std::to_string(n) + "}}");
       }},
      {"PastBufferView", "/meshes/0/primitives/0/attributes/POSITION",
       "reach past the end of /bufferViews/0",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":4})";
       }},
      {"CountOverflows", "/meshes/0/primitives/0/attributes/POSITION",
       "CATOPTRIC_SCENE_MIB raises this limit",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":9007199254740991})";
       }},
      {"CountOutOfRange", "/accessors/0/count", "out of range",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":0})";
       }},
      {"HugeWithoutBufferView", "/meshes/0/primitives/0/attributes/POSITION",
       "CATOPTRIC_SCENE_MIB raises this limit",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] = R"({"componentType":5126,"type":"VEC3","count":1000000000})";
       }},
      {"PastBuffer", "/meshes/0/primitives/0/attributes/POSITION",
       "reaches past the end of its buffer",
       [](GltfWriter& w) { w.arrays["bufferViews"][0] = R"({"buffer":0,"byteLength":3600})"; }},
      {"ViewOffsetOverflows", "/meshes/0/primitives/0/attributes/POSITION", "reaches past the end",
       [](GltfWriter& w) {
         w.arrays["bufferViews"][0] =
             R"({"buffer":0,"byteOffset":9007199254740988,"byteLength":36})";
       }},
      {"Misaligned", "/meshes/0/primitives/0/attributes/POSITION", "is not aligned to 4 bytes",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"byteOffset":2,"componentType":5126,"type":"VEC3","count":2})";
       }},
      {"StrideTooSmall", "/meshes/0/primitives/0/attributes/POSITION", "byteStride 4 is smaller",
       [](GltfWriter& w) {
         w.arrays["bufferViews"][0] = R"({"buffer":0,"byteLength":36,"byteStride":4})";
       }},
      {"OddStride", "/bufferViews/0/byteStride", "14 is not a multiple of 4",
       [](GltfWriter& w) {
         w.arrays["bufferViews"][0] = R"({"buffer":0,"byteLength":36,"byteStride":14})";
       }},
      {"EmptyImage", "/images/0/uri", "holds no data",
       [](GltfWriter& w) { w.add("images", R"({"uri":"data:image/png;base64,"})"); }},
  };
}

/// Accessors: types, values, sparse ones.
std::vector<Bad> badValues() {
  return {
      {"WrongType", "/meshes/0/primitives/0/attributes/POSITION", "type is VEC2, must be VEC3",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5126,"type":"VEC2","count":3})";
       }},
      {"UnknownType", "/accessors/0/type", "\"VEC5\" is not one of",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5126,"type":"VEC5","count":3})";
       }},
      {"IntComponents", "/accessors/0/componentType", "5124 is not one of",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5124,"type":"VEC3","count":3})";
       }},
      {"QuantizedWithoutExtension", "/meshes/0/primitives/0/attributes/POSITION",
       "component type 5122 is not allowed here: float",
       [](GltfWriter& w) {
         w.arrays["accessors"][0] =
             R"({"bufferView":0,"componentType":5122,"type":"VEC3","count":3})";
       }},
      {"FloatIndices", "/meshes/0/primitives/0/indices", "is not allowed here",
       [](GltfWriter& w) {
         const int i = w.floats({0, 1, 2}, "SCALAR");
         primitive(w, R"({"attributes":{"POSITION":0},"indices":)" + std::to_string(i) + "}");
       }},
      {"NanPosition", "/meshes/0/primitives/0/attributes/POSITION", "element 1 has the value nan",
       [](GltfWriter& w) { w.buffer.replace(12, 4, std::string("\0\0\xc0\x7f", 4)); }},
      {"InfinitePosition", "/meshes/0/primitives/0/attributes/POSITION", "has the value inf",
       [](GltfWriter& w) { w.buffer.replace(12, 4, std::string("\0\0\x80\x7f", 4)); }},
      {"HugePosition", "/meshes/0/primitives/0/attributes/POSITION", "below 1e18 are allowed",
       [](GltfWriter& w) { w.buffer.replace(12, 4, std::string("\0\0\0\x60", 4)); }},
      {"SparseIndexOutOfRange", "/meshes/0/primitives/0/attributes/POSITION",
       "sparse/indices: index 7",
       [](GltfWriter& w) {
         const int at = w.view(bytesOf(std::vector<std::uint16_t>{7}));
         w.arrays["accessors"][0] =
             R"({"componentType":5126,"type":"VEC3","count":3,"sparse":{"count":1,"indices":{"bufferView":)" +
             std::to_string(at) + R"(,"componentType":5123},"values":{"bufferView":0}}})";
       }},
      {"SparseNotIncreasing", "/meshes/0/primitives/0/attributes/POSITION", "not increasing",
       [](GltfWriter& w) {
         const int at = w.view(bytesOf(std::vector<std::uint16_t>{1, 1}));
         w.arrays["accessors"][0] =
             R"({"componentType":5126,"type":"VEC3","count":3,"sparse":{"count":2,"indices":{"bufferView":)" +
             std::to_string(at) + R"(,"componentType":5123},"values":{"bufferView":0}}})";
       }},
      {"SparsePastView", "/meshes/0/primitives/0/attributes/POSITION", "sparse/indices: 3 elements",
       [](GltfWriter& w) {
         const int at = w.view(bytesOf(std::vector<std::uint16_t>{0, 1}));
         w.arrays["accessors"][0] =
             R"({"componentType":5126,"type":"VEC3","count":3,"sparse":{"count":3,"indices":{"bufferView":)" +
             std::to_string(at) + R"(,"componentType":5123},"values":{"bufferView":0}}})";
       }},
      {"IndicesWithoutView", "/accessors/3", "holds indices but has no bufferView",
       [](GltfWriter& w) {
         w.accessor(-1, 5123, "SCALAR", 3);
         primitive(w, R"({"attributes":{"POSITION":0},"indices":3})");
       }},
  };
}

/// Primitives.
std::vector<Bad> badPrimitives() {
  return {
      {"BadMode", "/meshes/0/primitives/0/mode", "7 is not one of",
       [](GltfWriter& w) { primitive(w, R"({"attributes":{"POSITION":0},"mode":7})"); }},
      {"JointsWithoutWeights", "/meshes/0/primitives/0/attributes", "must be given together",
       [](GltfWriter& w) { primitive(w, R"({"attributes":{"POSITION":0,"JOINTS_0":0}})"); }},
      {"TargetCounts", "/meshes/0/primitives/1/targets", "has 0 morph targets",
       [](GltfWriter& w) {
         primitive(
             w,
             R"({"attributes":{"POSITION":0},"targets":[{"POSITION":0}]},{"attributes":{"POSITION":0}})");
       }},
      {"WeightCount", "/meshes/0/weights", "has 1 numbers, the mesh has 0",
       [](GltfWriter& w) {
         w.arrays["meshes"] = {R"({"weights":[1],"primitives":[{"attributes":{"POSITION":0}}]})"};
       }},
  };
}

/// Nodes.
std::vector<Bad> badNodes() {
  return {
      {"OwnChild", "/nodes/0/children/0", "its own child",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"children":[0]})"}; }},
      {"Cycle", "/nodes/1", "cycle",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {"{}", R"({"children":[2]})", R"({"children":[1]})"};
       }},
      {"CycleInScene", "/nodes/1", "cycle",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {"{}", R"({"children":[2]})", R"({"children":[1]})"};
         w.arrays["scenes"] = {R"({"nodes":[1]})"};
       }},
      {"TwoParents", "/nodes/1/children/0", "is a child of node 0 already",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {R"({"children":[2]})", R"({"children":[2]})", "{}"};
       }},
      {"SceneTwice", "/scenes/0/nodes/1", "listed twice",
       [](GltfWriter& w) { w.arrays["scenes"] = {R"({"nodes":[0,0]})"}; }},
      {"MatrixAndTrs", "/nodes/0", "both \"matrix\" and",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[1,1,1]})"};
       }},
      {"Projection", "/nodes/0/matrix", "last row",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {R"({"matrix":[1,0,0,0.5,0,1,0,0,0,0,1,0,0,0,0,1]})"};
       }},
      {"ShortMatrix", "/nodes/0/matrix", "has 15 numbers, 16 are needed",
       [](GltfWriter& w) {
         w.arrays["nodes"] = {R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0]})"};
       }},
      {"LongRotation", "/nodes/0/rotation", "has length 2.000000, must be 1",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"rotation":[0,0,0,2]})"}; }},
      {"ZeroRotation", "/nodes/0/rotation", "has length 0.000000",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"rotation":[0,0,0,0]})"}; }},
      {"HugeTranslation", "/nodes/0/translation/1", "1e+19 is out of range",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"translation":[0,1e19,0]})"}; }},
      {"InstanceCounts", "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/SCALE",
       "has 3 elements, TRANSLATION has 2",
       [](GltfWriter& w) {
         const int t = w.floats({0, 0, 0, 1, 1, 1}, "VEC3");
         w.arrays["nodes"] = {
             R"({"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"SCALE":0,"TRANSLATION":)" +
             std::to_string(t) + "}}}}"};
       }},
  };
}

/// Skins and animation.
std::vector<Bad> badMotion() {
  return {
      {"JointOutOfRange", "/meshes/0/primitives/0/attributes/JOINTS_0", "/skins/0 has 1 joints",
       [](GltfWriter& w) {
         const int j = w.accessor(
             w.view(bytesOf(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0})), 5121,
             "VEC4", 3);
         const int v = w.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
         primitive(w, R"({"attributes":{"POSITION":0,"JOINTS_0":)" + std::to_string(j) +
                          ",\"WEIGHTS_0\":" + std::to_string(v) + "}}");
         w.add("skins", R"({"joints":[0]})");
         w.arrays["nodes"] = {R"({"mesh":0,"skin":0})"};
       }},
      {"FewBindMatrices", "/skins/0/inverseBindMatrices", "has 1 matrices, the skin has 2 joints",
       [](GltfWriter& w) {
         const int m = w.floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "MAT4");
         w.add("nodes", "{}");
         w.add("skins", R"({"joints":[0,1],"inverseBindMatrices":)" + std::to_string(m) + "}");
       }},
      {"TimesNotIncreasing", "/animations/0/samplers/0/input", "strictly increasing",
       [](GltfWriter& w) {
         const int t = w.floats({0, 1, 1}, "SCALAR");
         w.add("animations", animation("translation", t, 0));
       }},
      {"OutputCount", "/animations/0/samplers/0/output", "has 3 elements, 9 are needed for 3 keys",
       [](GltfWriter& w) {
         const int t = w.floats({0, 1, 2}, "SCALAR");
         w.add("animations", animation("translation", t, 0, "CUBICSPLINE"));
       }},
      {"UnknownInterpolation", "/animations/0/samplers/0/interpolation", "\"SMOOTH\" is not one of",
       [](GltfWriter& w) { w.add("animations", animation("scale", 0, 0, "SMOOTH")); }},
      {"AnimatedMatrix", "/animations/0/channels/0/target/node", "must not have a matrix",
       [](GltfWriter& w) {
         const int t = w.floats({0, 1, 2}, "SCALAR");
         w.arrays["nodes"] = {R"({"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})"};
         w.add("animations", animation("translation", t, 0));
       }},
      {"AnimatedRotationNotUnit", "/animations/0/samplers/0/output (key 1)", "length 3.0",
       [](GltfWriter& w) {
         const int t = w.floats({0, 1}, "SCALAR");
         const int r = w.floats({0, 0, 0, 1, 0, 0, 0, 3}, "VEC4");
         w.add("animations", animation("rotation", t, r));
       }},
      {"WeightsWithoutTargets", "/animations/0/channels/0/target", "no morph targets",
       [](GltfWriter& w) {
         const int t = w.floats({0, 1}, "SCALAR");
         w.add("animations", animation("weights", t, t));
       }},
  };
}

/// Lights and materials.
std::vector<Bad> badLook() {
  return {
      {"SpotCone", "/extensions/KHR_lights_punctual/lights/0/spot",
       "must be less than outerConeAngle",
       [](GltfWriter& w) {
         w.members["extensions"] =
             R"({"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"innerConeAngle":0.5,"outerConeAngle":0.5}}]}})";
         w.arrays["nodes"] = {R"({"extensions":{"KHR_lights_punctual":{"light":0}}})"};
       }},
      {"UnknownLight", "/extensions/KHR_lights_punctual/lights/0/type", "\"area\" is not one of",
       [](GltfWriter& w) {
         w.members["extensions"] = R"({"KHR_lights_punctual":{"lights":[{"type":"area"}]}})";
       }},
      {"BaseColor", "/materials/0/pbrMetallicRoughness/baseColorFactor",
       "has 3 numbers, 4 are needed",
       [](GltfWriter& w) {
         w.add("materials", R"({"pbrMetallicRoughness":{"baseColorFactor":[1,1,1]}})");
       }},
      {"Roughness", "/materials/0/pbrMetallicRoughness/roughnessFactor", "1.5 is out of range",
       [](GltfWriter& w) {
         w.add("materials", R"({"pbrMetallicRoughness":{"roughnessFactor":1.5}})");
       }},
      {"AlphaMode", "/materials/0/alphaMode", "\"GLASS\" is not one of OPAQUE, MASK, BLEND",
       [](GltfWriter& w) { w.add("materials", R"({"alphaMode":"GLASS"})"); }},
      {"Ior", "/materials/0/extensions/KHR_materials_ior/ior", "0.5",
       [](GltfWriter& w) {
         w.add("materials", R"({"extensions":{"KHR_materials_ior":{"ior":0.5}}})");
       }},
      {"ExtrasUnknown", "/materials/0/extras/catoptric/gloss", "s, g and n are allowed",
       [](GltfWriter& w) { w.add("materials", R"({"extras":{"catoptric":{"gloss":1}}})"); }},
      {"ExtrasRange", "/nodes/0/extras/catoptric/s", "2 is out of range: 0 to 1",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"extras":{"catoptric":{"s":2}}})"}; }},
      {"ExtrasBoth", "/nodes/0/extras/catoptric", "has both",
       [](GltfWriter& w) { w.arrays["nodes"] = {R"({"extras":{"catoptric":{"g":0.5,"n":2}}})"}; }},
      {"UvSet", "/materials/0/emissiveTexture", "set 2 is not supported",
       [](GltfWriter& w) {
         w.add("images", R"({"uri":"x.png"})");
         w.add("textures", R"({"source":0})");
         w.add("materials", R"({"emissiveTexture":{"index":0,"texCoord":2}})");
       }},
  };
}

/// Buffers, images, URIs.
std::vector<Bad> badFilesBeside() {
  return {
      {"NoUri", "/buffers/0", "has no uri",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78})"); }},
      {"ShortDataUri", "/buffers/0", "byteLength is 78, but the data URI has 3 bytes",
       [](GltfWriter& w) {
         w.add("buffers", R"({"byteLength":78,"uri":"data:application/octet-stream;base64,AAAA"})");
       }},
      {"BadBase64", "/buffers/0/uri", "invalid character at byte 2",
       [](GltfWriter& w) {
         w.add("buffers", R"({"byteLength":3,"uri":"data:application/octet-stream;base64,AA*A"})");
       }},
      {"MissingFile", "/buffers/0/uri", "No such file",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"nothing.bin"})"); }},
      {"OutsideFolder", "/buffers/0/uri", "is outside the folder",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"a/../../secret.bin"})"); }},
      {"EncodedOutside", "/buffers/0/uri", "is outside the folder",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"%2e%2e/secret.bin"})"); }},
      {"AbsolutePath", "/images/0/uri", "is outside the folder",
       [](GltfWriter& w) { w.add("images", R"({"uri":"/etc/passwd"})"); }},
      {"Http", "/images/0/uri", "only relative paths",
       [](GltfWriter& w) { w.add("images", R"({"uri":"http://example.org/a.png"})"); }},
      {"BadPercent", "/images/0/uri", "bad percent encoding",
       [](GltfWriter& w) { w.add("images", R"({"uri":"a%zz.png"})"); }},
      {"DirectoryUri", "/buffers/0/uri", "regular file",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"folder"})"); }},
      {"FifoUri", "/buffers/0/uri", "regular file",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"fifo"})"); }},
      {"ShortFile", "/buffers/0/uri", "has 5 bytes, byteLength says 78",
       [](GltfWriter& w) { w.add("buffers", R"({"byteLength":78,"uri":"short.bin"})"); }},
      {"ImageBoth", "/images/0", "both a uri and a bufferView",
       [](GltfWriter& w) { w.add("images", R"({"uri":"a.png","bufferView":0})"); }},
      {"ImageNeither", "/images/0", "neither a uri nor a bufferView",
       [](GltfWriter& w) { w.add("images", R"({"mimeType":"image/png"})"); }},
      {"ImageGarbage", "/images/0", "",
       [](GltfWriter& w) {
         w.add("images", R"({"bufferView":0,"mimeType":"image/png"})");
         w.add("textures", R"({"source":0})");
         w.add("materials", R"({"emissiveTexture":{"index":0}})");
       }},
      {"ImagePastBuffer", "/images/0", "reaches past the end of its buffer",
       [](GltfWriter& w) {
         w.add("bufferViews", R"({"buffer":0,"byteOffset":70,"byteLength":4000000000})");
         w.add("images", R"({"bufferView":3,"mimeType":"image/png"})");
         w.add("textures", R"({"source":0})");
         w.add("materials", R"({"emissiveTexture":{"index":0}})");
       }},
  };
}

const std::vector<Bad>& badFiles() {
  static const std::vector<Bad> files = [] {
    std::vector<Bad> all;
    for (const auto& some : {badSyntax(), badIndices(), badAccessors(), badValues(),
                             badPrimitives(), badNodes(), badMotion(), badLook(), badFilesBeside()})
      all.insert(all.end(), some.begin(), some.end());
    return all;
  }();
  return files;
}

void PrintTo(const Bad& bad, std::ostream* out) {
  *out << bad.name;
}

class BadGltf : public ::testing::TestWithParam<Bad> {};

TEST_P(BadGltf, IsRefusedWithPlaceAndReason) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "folder");
  ASSERT_EQ(::mkfifo((folder.path() / "fifo").c_str(), 0600), 0);
  folder.write("short.bin", "12345");
  GltfWriter w = triangleFile();
  GetParam().change(w);
  const std::filesystem::path file = w.gltf(folder);
  const std::string expectedStart =
      file.string() + ":" + (GetParam().place.empty() ? "" : " " + GetParam().place);
  EXPECT_THAT(errorOf(file), AllOf(StartsWith(expectedStart), HasSubstr(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(Files, BadGltf, ::testing::ValuesIn(badFiles()),
                         [](const auto& instance) { return instance.param.name; });

TEST(BadGltfFile, TheUnchangedFileLoads) {
  const TemporaryFolder folder;
  EXPECT_EQ(errorOf(triangleFile().gltf(folder)), "(loaded)");
}

TEST(BadGltfFile, NotARegularFile) {
  const TemporaryFolder folder;
  const std::filesystem::path fifo = folder.path() / "fifo.gltf";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  for (const std::filesystem::path& file : {fifo, folder.path(), folder.path() / "missing.gltf"}) {
    EXPECT_THAT(errorOf(file), StartsWith(file.string() + ": "));
  }
  EXPECT_THAT(errorOf(folder.write("empty.gltf", "")), HasSubstr("too short"));
}

TEST(BadGltfFile, Containers) {
  const TemporaryFolder folder;
  const GltfWriter w = triangleFile();
  const std::string good = GltfWriter::glbBytes(w.json(false), w.buffer);
  // Cut anywhere, it is refused; nothing reads past the end.
  for (std::size_t length = 0; length < good.size(); length += 7) {
    EXPECT_NE(errorOf(folder.write("cut.glb", good.substr(0, length))), "(loaded)") << length;
  }
  const auto with = [&](std::size_t at, const std::string& bytes) {
    std::string changed = good;
    changed.replace(at, bytes.size(), bytes);
    return errorOf(folder.write("changed.glb", changed));
  };
  EXPECT_THAT(with(4, std::string("\1\0\0\0", 4)), HasSubstr("GLB version 1 is not supported"));
  EXPECT_THAT(with(8, std::string("\xff\xff\xff\xff", 4)), HasSubstr("GLB length says 4294967295"));
  EXPECT_THAT(with(12, std::string("\xfc\xff\xff\xff", 4)), HasSubstr("reaches past the end"));
  EXPECT_THAT(with(16, "BIN "), HasSubstr("first GLB chunk is not JSON"));
  // A BIN chunk shorter than the buffer, and none at all.
  EXPECT_THAT(errorOf(folder.write("short.glb", GltfWriter::glbBytes(w.json(false), "1234"))),
              HasSubstr("/buffers/0/byteLength: 78 bytes, but the BIN chunk has 4"));
  EXPECT_THAT(errorOf(folder.write("none.glb", GltfWriter::glbBytes(w.json(false), ""))),
              HasSubstr("but the BIN chunk has 0"));
}

TEST(BadGltfFile, Limits) {
  const TemporaryFolder folder;
  const std::filesystem::path file = triangleFile().gltf(folder);
  LoadLimits limits;
  limits.maxFileBytes = 100;
  EXPECT_THAT(errorOf(file, limits), HasSubstr(file.string()));
  limits = {};
  limits.maxBytes = 50;
  EXPECT_THAT(errorOf(file, limits),
              HasSubstr("more than 50 bytes of memory; CATOPTRIC_SCENE_MIB raises this limit"));
  limits = {};
  limits.maxNodes = 0;
  EXPECT_THAT(errorOf(file, limits), HasSubstr("/nodes: 1 nodes, more than the 0 allowed"));
}

TEST(BadGltfFile, UnknownKindOfScene) {
  try {
    loadScene("room.obj");
    FAIL() << "loaded";
  } catch (const SceneError& e) {
    EXPECT_STREQ(e.what(),
                 "room.obj: \".obj\" is not a kind of scene; the kinds are .json, .gltf and .glb");
  }
}

}  // namespace
}  // namespace catoptric::scene
