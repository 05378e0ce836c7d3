// Writes small glTF files for tests.
#pragma once

#include <unistd.h>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace catoptric::scene::testing {

/// A folder that is removed with its contents on destruction.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "catoptric_gltf_XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

template <class T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u;
    };
    const std::uint32_t bits = (at(0) << 16) | (at(1) << 8) | at(2);
    result += kDigits[bits >> 18];
    result += kDigits[(bits >> 12) & 63];
    result += i + 1 < bytes.size() ? kDigits[(bits >> 6) & 63] : '=';
    result += i + 2 < bytes.size() ? kDigits[bits & 63] : '=';
  }
  return result;
}

/// A glTF file under construction: named arrays of JSON texts, and one buffer.
struct GltfWriter {
  std::map<std::string, std::vector<std::string>> arrays;
  std::map<std::string, std::string> members;  ///< other root members
  std::string buffer;

  int add(const std::string& array, const std::string& json) {
    arrays[array].push_back(json);
    return static_cast<int>(arrays[array].size()) - 1;
  }

  int view(const std::string& bytes, int stride = 0) {
    while (buffer.size() % 4 != 0) buffer += '\0';
    const std::string json = "{\"buffer\":0,\"byteOffset\":" + std::to_string(buffer.size()) +
                             ",\"byteLength\":" + std::to_string(bytes.size()) +
                             (stride > 0 ? ",\"byteStride\":" + std::to_string(stride) : "") + "}";
    buffer += bytes;
    return add("bufferViews", json);
  }

  int accessor(int bufferView, int componentType, const std::string& type, std::size_t count,
               const std::string& more = "") {
    return add("accessors",
               "{" +
                   (bufferView >= 0 ? "\"bufferView\":" + std::to_string(bufferView) + ","
                                    : std::string()) +
                   "\"componentType\":" + std::to_string(componentType) + ",\"type\":\"" + type +
                   "\",\"count\":" + std::to_string(count) + (more.empty() ? "" : "," + more) +
                   "}");
  }

  int floats(const std::vector<float>& values, const std::string& type) {
    static const std::map<std::string, std::size_t> kComponents = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    return accessor(view(bytesOf(values)), 5126, type, values.size() / kComponents.at(type));
  }
  int indices(const std::vector<std::uint16_t>& values) {
    return accessor(view(bytesOf(values)), 5123, "SCALAR", values.size());
  }

  std::string json(bool withUri) const {
    std::string text = "{\"asset\":{\"version\":\"2.0\"}";
    if (members.count("asset") > 0) text = "{\"asset\":" + members.at("asset");
    for (const auto& [name, value] : members) {
      if (name != "asset") text += ",\n\"" + name + "\":" + value;
    }
    for (const auto& [name, items] : arrays) {
      text += ",\n\"" + name + "\":[";
      for (std::size_t i = 0; i < items.size(); ++i) text += (i > 0 ? ",\n" : "\n") + items[i];
      text += "]";
    }
    if (!buffer.empty() && arrays.count("buffers") == 0) {
      text += ",\n\"buffers\":[{\"byteLength\":" + std::to_string(buffer.size());
      if (withUri) {
        text += ",\"uri\":\"data:application/octet-stream;base64," + base64(buffer) + "\"";
      }
      text += "}]";
    }
    return text + "}";
  }

  std::filesystem::path gltf(const TemporaryFolder& folder,
                             const std::string& name = "test.gltf") const {
    return folder.write(name, json(true));
  }
  static std::string glbBytes(std::string text, std::string bin) {
    while (text.size() % 4 != 0) text += ' ';
    while (bin.size() % 4 != 0) bin += '\0';
    const auto word = [](std::size_t v) {
      const auto w = static_cast<std::uint32_t>(v);
      return std::string(reinterpret_cast<const char*>(&w), 4);
    };
    const std::size_t binSize = bin.empty() ? 0 : 8 + bin.size();
    std::string out =
        "glTF" + word(2) + word(20 + text.size() + binSize) + word(text.size()) + "JSON" + text;
    if (!bin.empty()) out += word(bin.size()) + std::string("BIN\0", 4) + bin;
    return out;
  }
  std::filesystem::path glb(const TemporaryFolder& folder,
                            const std::string& name = "test.glb") const {
    return folder.write(name, glbBytes(json(false), buffer));
  }
};

/// A triangle (0,0,0) (1,0,0) (0,1,0) with normals +z. Accessors: 0 POSITION, 1 NORMAL, 2 indices;
/// the triangle is mesh 0 of node 0.
inline GltfWriter triangleFile() {
  GltfWriter w;
  w.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
  w.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  w.indices({0, 1, 2});
  w.add("meshes",
        R"({"name":"tri","primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]})");
  w.add("nodes", R"({"name":"n","mesh":0})");
  w.add("scenes", R"({"nodes":[0]})");
  return w;
}

}  // namespace catoptric::scene::testing
