// The data that the parts of the glTF loader share: the parsed model, checked access to its data,
// and the scene under construction.
#pragma once

#include <tiny_gltf.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene/loader.h"
#include "scene/scene.h"

namespace catoptric::scene::gltf {

/// The component types that an accessor may have in one use: a bit per type, with separate bits for
/// plain and normalized integers.
enum Component : unsigned {
  kByte = 1u << 0,
  kUnsignedByte = 1u << 1,
  kShort = 1u << 2,
  kUnsignedShort = 1u << 3,
  kUnsignedInt = 1u << 4,
  kFloat = 1u << 5,
  kByteNormalized = 1u << 6,
  kUnsignedByteNormalized = 1u << 7,
  kShortNormalized = 1u << 8,
  kUnsignedShortNormalized = 1u << 9,
};

/// A file that is being loaded. Several threads may read accessors at the same time.
class Reader {
 public:
  Reader(const std::filesystem::path& path, const LoadLimits& limitsIn)
      : file(path.string()), limits(limitsIn) {}

  std::string file;
  LoadLimits limits;
  tinygltf::Model model;
  Scene scene;
  bool quantization = false;  ///< whether KHR_mesh_quantization is used

  [[noreturn]] void fail(const std::string& place, const std::string& message) const;

  /// Adds to the memory that the scene will need. Throws if the sum exceeds the limit.
  void reserveBytes(std::size_t bytes, const std::string& place);

  /// The elements of an accessor as floats, `components` per element, which must match the
  /// accessor's type. Normalized integers are scaled, and sparse values are applied. All values are
  /// finite and below 1e18. `place` refers to the accessor in messages.
  std::vector<float> floats(int accessor, int components, unsigned allowed,
                            const std::string& place);
  /// As floats(), but returns vectors: T is Vec2, Vec3, Vec4 or Mat4.
  template <class T>
  std::vector<T> vectors(int accessor, unsigned allowed, const std::string& place) {
    constexpr int kComponents = static_cast<int>(sizeof(T) / sizeof(float));
    const std::size_t count = prepare(accessor, kComponents, allowed, place);
    reserveBytes(count * sizeof(T), place);
    std::vector<T> result(count);
    readFloats(accessor, reinterpret_cast<float*>(result.data()), place);
    return result;
  }
  /// The elements of an integer accessor.
  std::vector<std::uint32_t> integers(int accessor, int components, unsigned allowed,
                                      const std::string& place);
  std::size_t countOf(int accessor) const {
    return model.accessors[static_cast<std::size_t>(accessor)].count;
  }
  int componentsOf(int accessor) const;

  /// The bytes of a buffer view, with a bounds check.
  std::span<const std::uint8_t> bytesOf(int bufferView, const std::string& place) const;
  /// The same of a part of a buffer, which messages call `what`.
  std::span<const std::uint8_t> bytesOf(int buffer, std::size_t offset, std::size_t length,
                                        const std::string& what, const std::string& place) const;

 private:
  struct Layout;
  Layout layoutOf(int accessor, const std::string& place) const;
  std::size_t prepare(int accessor, int components, unsigned allowed,
                      const std::string& place) const;
  void readFloats(int accessor, float* out, const std::string& place) const;

  std::atomic<std::size_t> bytes_{0};
};

// ---- Values of extensions and extras; rules.cpp checks their types ----

/// A member of an object value; a null value if absent.
const tinygltf::Value& member(const tinygltf::Value& object, const std::string& key);
const tinygltf::Value& extension(const tinygltf::ExtensionMap& extensions, const std::string& name);
double numberOr(const tinygltf::Value& object, const std::string& key, double otherwise);
Vec3 vec3Or(const tinygltf::Value& object, const std::string& key, const Vec3& otherwise);

std::string elementPlace(const char* array, std::size_t index);

/// An index of the file, which its reader has checked.
inline std::size_t size(int index) {
  return static_cast<std::size_t>(index);
}

/// A quaternion of the file. Throws SceneError at `place` if its length is not 1.
Quat unitRotation(const Reader& reader, float x, float y, float z, float w,
                  const std::string& place);

/// Replaces compressed buffer views, and accessors of compressed primitives, by plain ones.
void decompress(Reader& reader);

// ---- Functions that each fill one part of reader.scene ----

/// A loaded primitive.
struct Primitive {
  Mesh mesh;
  int material = kNone;
  bool drawn = false;  ///< false for points, lines, and primitives without positions
  std::vector<std::string> notes;
};

/// All primitives of all meshes, as [mesh][primitive]. Reads in parallel.
std::vector<std::vector<Primitive>> readPrimitives(Reader& reader);

/// Reads textures (decoded and mip-mapped in parallel) and materials. scene.materials are in the
/// order of the file. `needDefault` adds one for primitives that name none.
void readMaterials(Reader& reader, bool needDefault);

/// Sets s, g or n of `base` from the "catoptric" member of an extras object. Returns false if there
/// is no such member.
bool applyReflectanceExtras(const tinygltf::Value& extras, Material& base);

/// Orders nodes so that parents come before their children; maps node numbers between the file and
/// the scene.
struct NodeOrder {
  std::vector<int> sceneFromFile;
  std::vector<int> fileFromScene;
  std::vector<bool>
      inScene;  ///< by the file's numbers: whether it is below a root of the default scene
};
NodeOrder readNodes(Reader& reader);

void readSkins(Reader& reader, const NodeOrder& order);
void readObjects(Reader& reader, const NodeOrder& order,
                 std::vector<std::vector<Primitive>> primitives);
void readLightsAndCameras(Reader& reader, const NodeOrder& order);
void readAnimations(Reader& reader, const NodeOrder& order);

}  // namespace catoptric::scene::gltf
