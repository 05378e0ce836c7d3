// Mesh primitives: attributes, indices and modes, morph targets, flat normals.
#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "core/parallel.h"
#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {
namespace {

using AttributeMap = std::map<std::string, int>;

constexpr unsigned kColorTypes = kFloat | kUnsignedByteNormalized | kUnsignedShortNormalized;
constexpr unsigned kSignedNormalized = kByteNormalized | kShortNormalized;
constexpr unsigned kAllIntegers = kByte | kByteNormalized | kUnsignedByte |
                                  kUnsignedByteNormalized | kShort | kShortNormalized |
                                  kUnsignedShort | kUnsignedShortNormalized;

/// Applies `order` (new vertex -> old vertex) to an array that is empty or one per vertex.
template <class T>
void gather(std::vector<T>& values, const std::vector<std::uint32_t>& order) {
  if (values.empty()) return;
  std::vector<T> result(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) result[i] = values[order[i]];
  values = std::move(result);
}

void gatherVertices(Mesh& mesh, const std::vector<std::uint32_t>& order) {
  gather(mesh.positions, order);
  gather(mesh.normals, order);
  gather(mesh.tangents, order);
  gather(mesh.uv[0], order);
  gather(mesh.uv[1], order);
  gather(mesh.colors, order);
  gather(mesh.joints, order);
  gather(mesh.weights, order);
  for (MorphTarget& target : mesh.morphTargets) {
    gather(target.positions, order);
    gather(target.normals, order);
    gather(target.tangents, order);
  }
}

/// Drops vertices that no triangle uses: exporters share one vertex array among primitives.
void dropUnusedVertices(Mesh& mesh) {
  std::vector<std::uint32_t> newFromOld(mesh.positions.size(), 0);
  for (const std::uint32_t i : mesh.indices) newFromOld[i] = 1;
  std::vector<std::uint32_t> order;
  for (std::size_t i = 0; i < newFromOld.size(); ++i) {
    if (newFromOld[i] == 0) continue;
    newFromOld[i] = static_cast<std::uint32_t>(order.size());
    order.push_back(static_cast<std::uint32_t>(i));
  }
  if (order.size() == newFromOld.size()) return;
  gatherVertices(mesh, order);
  for (std::uint32_t& i : mesh.indices) i = newFromOld[i];
}

/// Unit normal of a triangle; for a degenerate one any that is perpendicular to its longest edge.
Vec3 flatNormal(const Vec3& a, const Vec3& b, const Vec3& c) {
  // In double: products of small edges would underflow.
  const glm::dvec3 u(glm::dvec3(b) - glm::dvec3(a));
  const glm::dvec3 v(glm::dvec3(c) - glm::dvec3(a));
  const glm::dvec3 n = glm::cross(u, v);
  const double length = glm::length(n);
  if (length > 1e-12 * glm::length(u) * glm::length(v)) return Vec3(n / length);
  const glm::dvec3 w = v - u;
  glm::dvec3 edge = glm::dot(u, u) > glm::dot(v, v) ? u : v;
  if (glm::dot(w, w) > glm::dot(edge, edge)) edge = w;
  const double edgeLength = glm::length(edge);
  if (!(edgeLength > 0.0)) return {0.0f, 1.0f, 0.0f};
  edge /= edgeLength;
  const glm::dvec3 axis = std::abs(edge.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  return Vec3(glm::normalize(axis - edge * glm::dot(axis, edge)));
}

/// glTF 2.0, section 3.7.2.1: a mesh without normals is shaded flat, so every triangle gets
/// vertices of its own; likewise for each morph target.
void makeFlat(Mesh& mesh) {
  gatherVertices(mesh, mesh.indices);
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    mesh.indices[i] = static_cast<std::uint32_t>(i);
  }
  mesh.normals.resize(mesh.positions.size());
  for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
    const Vec3 n = flatNormal(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]);
    mesh.normals[i] = mesh.normals[i + 1] = mesh.normals[i + 2] = n;
  }
  for (MorphTarget& target : mesh.morphTargets) {
    if (target.positions.empty()) continue;
    target.normals.resize(mesh.positions.size());
    for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
      const Vec3 n = flatNormal(mesh.positions[i] + target.positions[i],
                                mesh.positions[i + 1] + target.positions[i + 1],
                                mesh.positions[i + 2] + target.positions[i + 2]);
      for (std::size_t k = 0; k < 3; ++k) target.normals[i + k] = n - mesh.normals[i + k];
    }
  }
}

/// The triangle list of a strip or fan (glTF 2.0, section 3.7.2.1).
std::vector<std::uint32_t> trianglesOf(const std::vector<std::uint32_t>& v, int mode) {
  std::vector<std::uint32_t> triangles;
  if (v.size() < 3) return triangles;
  triangles.reserve((v.size() - 2) * 3);
  for (std::size_t i = 0; i + 2 < v.size(); ++i) {
    if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      triangles.insert(triangles.end(), {v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]});
    } else {
      triangles.insert(triangles.end(), {v[i + 1], v[i + 2], v[0]});
    }
  }
  return triangles;
}

class PrimitiveReader {
 public:
  PrimitiveReader(Reader& reader, const tinygltf::Primitive& source, std::string place)
      : reader_(reader), source_(source), place_(std::move(place)) {}

  Primitive read(const std::string& name) {
    result_.mesh.name = name;
    result_.material = source_.material;
    if (source_.mode < TINYGLTF_MODE_TRIANGLES) {
      note("points and lines are not drawn");
      return std::move(result_);
    }
    const std::optional<int> positions = find(source_.attributes, "POSITION");
    if (!positions) {
      note("has no POSITION and is not drawn");
      return std::move(result_);
    }
    count_ = reader_.countOf(*positions);
    readAttributes(*positions);
    readTargets();
    readIndices();
    if (result_.mesh.indices.empty()) {
      note("has no triangle and is not drawn");
      return std::move(result_);
    }
    if (result_.mesh.normals.empty()) {
      reader_.reserveBytes(
          result_.mesh.indices.size() * sizeof(Vec3) * (3 + 2 * result_.mesh.morphTargets.size()),
          place_);
      makeFlat(result_.mesh);
    } else {
      dropUnusedVertices(result_.mesh);
    }
    result_.drawn = true;
    return std::move(result_);
  }

 private:
  void note(const std::string& text) { result_.notes.push_back(place_ + ": " + text); }

  static std::optional<int> find(const AttributeMap& map, const std::string& name) {
    const auto found = map.find(name);
    return found == map.end() ? std::nullopt : std::optional<int>(found->second);
  }

  unsigned withQuantized(unsigned plain, unsigned quantized) const {
    return reader_.quantization ? plain | quantized : plain;
  }

  /// One attribute as vectors, one per vertex; empty when absent.
  template <class T>
  std::vector<T> attribute(const AttributeMap& map, const std::string& name, unsigned allowed,
                           const std::string& base) {
    const std::optional<int> accessor = find(map, name);
    if (!accessor) return {};
    const std::string place = base + "/" + name;
    checkCount(*accessor, place);
    return reader_.vectors<T>(*accessor, allowed, place);
  }

  void checkCount(int accessor, const std::string& place) const {
    if (reader_.countOf(accessor) != count_) {
      reader_.fail(place, elementPlace("accessors", static_cast<std::size_t>(accessor)) + " has " +
                              std::to_string(reader_.countOf(accessor)) +
                              " elements, POSITION has " + std::to_string(count_));
    }
  }

  void readAttributes(int positions) {
    Mesh& mesh = result_.mesh;
    const AttributeMap& map = source_.attributes;
    const std::string base = place_ + "/attributes";
    mesh.positions =
        reader_.vectors<Vec3>(positions, withQuantized(kFloat, kAllIntegers), base + "/POSITION");
    mesh.normals = attribute<Vec3>(map, "NORMAL", withQuantized(kFloat, kSignedNormalized), base);
    // Without normals glTF has given tangents ignored.
    if (!mesh.normals.empty()) {
      mesh.tangents =
          attribute<Vec4>(map, "TANGENT", withQuantized(kFloat, kSignedNormalized), base);
      for (Vec4& t : mesh.tangents) t.w = t.w < 0.0f ? -1.0f : 1.0f;
    }
    const unsigned uvTypes = withQuantized(kColorTypes, kAllIntegers);
    mesh.uv[0] = attribute<Vec2>(map, "TEXCOORD_0", uvTypes, base);
    mesh.uv[1] = attribute<Vec2>(map, "TEXCOORD_1", uvTypes, base);
    readColors(map, base);
    readSkinning(map, base);
    for (const auto& [name, accessor] : map) {
      const bool read = name == "POSITION" || name == "NORMAL" || name == "TANGENT" ||
                        name == "TEXCOORD_0" || name == "TEXCOORD_1" || name == "COLOR_0" ||
                        name == "JOINTS_0" || name == "WEIGHTS_0" || name == "JOINTS_1" ||
                        name == "WEIGHTS_1";
      if (!read && name[0] != '_') note("attribute " + name + " is ignored");
    }
  }

  void readColors(const AttributeMap& map, const std::string& base) {
    const std::optional<int> accessor = find(map, "COLOR_0");
    if (!accessor) return;
    const std::string place = base + "/COLOR_0";
    checkCount(*accessor, place);
    if (reader_.componentsOf(*accessor) == 3) {
      result_.mesh.colors = reader_.vectors<Vec3>(*accessor, kColorTypes, place);
      return;
    }
    const std::vector<Vec4> colors = reader_.vectors<Vec4>(*accessor, kColorTypes, place);
    result_.mesh.colors.reserve(colors.size());
    bool opaque = true;
    for (const Vec4& c : colors) {
      result_.mesh.colors.emplace_back(c);
      opaque &= c.w == 1.0f;
    }
    if (!opaque) note("the alpha of COLOR_0 is ignored");
  }

  /// Up to eight influences a vertex; the four strongest are kept and sum to 1.
  void readSkinning(const AttributeMap& map, const std::string& base) {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<Vec4>> weights;
    for (int set = 0; set < 2; ++set) {
      const std::string jointsName = "JOINTS_" + std::to_string(set);
      const std::string weightsName = "WEIGHTS_" + std::to_string(set);
      const std::optional<int> j = find(map, jointsName);
      const std::optional<int> w = find(map, weightsName);
      if (j.has_value() != w.has_value()) {
        reader_.fail(base, jointsName + " and " + weightsName + " must be given together");
      }
      if (!j) break;
      checkCount(*j, base + "/" + jointsName);
      joints.push_back(
          reader_.integers(*j, 4, kUnsignedByte | kUnsignedShort, base + "/" + jointsName));
      weights.push_back(attribute<Vec4>(map, weightsName, kColorTypes, base));
    }
    if (joints.empty()) return;

    Mesh& mesh = result_.mesh;
    mesh.joints.resize(count_);
    mesh.weights.resize(count_);
    std::size_t unweighted = 0;
    std::size_t reduced = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      std::array<std::pair<float, std::uint32_t>, 8> influences{};
      for (std::size_t set = 0; set < joints.size(); ++set) {
        for (std::size_t k = 0; k < 4; ++k) {
          const float weight = weights[set][i][static_cast<int>(k)];
          if (weight < 0.0f) {
            reader_.fail(base + "/WEIGHTS_" + std::to_string(set), "vertex " + std::to_string(i) +
                                                                       " has the negative weight " +
                                                                       std::to_string(weight));
          }
          influences[set * 4 + k] = {weight, joints[set][i * 4 + k]};
        }
      }
      if (joints.size() > 1) {
        std::stable_sort(influences.begin(), influences.end(),
                         [](const auto& a, const auto& b) { return a.first > b.first; });
        reduced += influences[4].first > 0.0f ? 1 : 0;
      }
      float sum = 0.0f;
      for (std::size_t k = 0; k < 4; ++k) sum += influences[k].first;
      if (!(sum > 0.0f)) {
        ++unweighted;
        influences[0].first = sum = 1.0f;
      }
      for (std::size_t k = 0; k < 4; ++k) {
        const float w = influences[k].first / sum;
        mesh.weights[i][static_cast<int>(k)] = w;
        // A joint without weight may be any number in the file; 0 always exists.
        mesh.joints[i][static_cast<int>(k)] =
            w > 0.0f ? static_cast<std::uint16_t>(influences[k].second) : std::uint16_t{0};
      }
    }
    if (unweighted > 0) {
      note(std::to_string(unweighted) + " vertices without weights follow their first joint");
    }
    if (reduced > 0) {
      note(std::to_string(reduced) +
           " vertices have more than 4 joints; only the strongest 4 are used");
    }
  }

  void readTargets() {
    for (std::size_t t = 0; t < source_.targets.size(); ++t) {
      const AttributeMap& map = source_.targets[t];
      const std::string base = place_ + "/targets/" + std::to_string(t);
      MorphTarget target;
      target.positions = attribute<Vec3>(
          map, "POSITION", withQuantized(kFloat, kByte | kShort | kSignedNormalized), base);
      if (!result_.mesh.normals.empty()) {
        target.normals =
            attribute<Vec3>(map, "NORMAL", withQuantized(kFloat, kSignedNormalized), base);
        target.tangents =
            attribute<Vec3>(map, "TANGENT", withQuantized(kFloat, kSignedNormalized), base);
      }
      for (const auto& [name, accessor] : map) {
        if (name != "POSITION" && name != "NORMAL" && name != "TANGENT" && name[0] != '_') {
          result_.notes.push_back(base + ": attribute " + name + " is ignored");
        }
      }
      result_.mesh.morphTargets.push_back(std::move(target));
    }
  }

  void readIndices() {
    std::vector<std::uint32_t> vertices;
    const std::string place = place_ + "/indices";
    if (source_.indices >= 0) {
      vertices = reader_.integers(source_.indices, 1, kUnsignedByte | kUnsignedShort | kUnsignedInt,
                                  place);
      std::uint32_t largest = 0;
      for (const std::uint32_t i : vertices) largest = std::max(largest, i);
      if (largest >= count_) {
        const auto bad = std::find_if(vertices.begin(), vertices.end(),
                                      [&](std::uint32_t i) { return i >= count_; });
        reader_.fail(place, "index " + std::to_string(*bad) + " at " +
                                std::to_string(bad - vertices.begin()) +
                                " is out of range: the primitive has " + std::to_string(count_) +
                                " vertices");
      }
    } else {
      if (count_ > 0xFFFFFFFFull) reader_.fail(place_, "has more than 2^32 vertices");
      reader_.reserveBytes(count_ * sizeof(std::uint32_t), place_);
      vertices.resize(count_);
      for (std::size_t i = 0; i < count_; ++i) vertices[i] = static_cast<std::uint32_t>(i);
    }
    if (source_.mode == TINYGLTF_MODE_TRIANGLES) {
      if (vertices.size() % 3 != 0) {
        reader_.fail(source_.indices >= 0 ? place : place_,
                     std::to_string(vertices.size()) + " vertices are not a multiple of 3");
      }
      result_.mesh.indices = std::move(vertices);
    } else {
      reader_.reserveBytes(vertices.size() * 2 * sizeof(std::uint32_t), place_);
      result_.mesh.indices = trianglesOf(vertices, source_.mode);
    }
  }

  Reader& reader_;
  const tinygltf::Primitive& source_;
  std::string place_;
  std::size_t count_ = 0;
  Primitive result_;
};

}  // namespace

std::vector<std::vector<Primitive>> readPrimitives(Reader& reader) {
  struct Job {
    std::size_t mesh = 0;
    std::size_t primitive = 0;
    std::exception_ptr error;
  };
  std::vector<std::vector<Primitive>> result(reader.model.meshes.size());
  std::vector<Job> jobs;
  for (std::size_t m = 0; m < reader.model.meshes.size(); ++m) {
    result[m].resize(reader.model.meshes[m].primitives.size());
    for (std::size_t p = 0; p < result[m].size(); ++p) jobs.push_back({m, p, nullptr});
  }
  parallelFor(jobs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Job& job = jobs[i];
      const tinygltf::Mesh& mesh = reader.model.meshes[job.mesh];
      try {
        const std::string place =
            elementPlace("meshes", job.mesh) + "/primitives/" + std::to_string(job.primitive);
        std::string name = mesh.name.empty() ? "mesh " + std::to_string(job.mesh) : mesh.name;
        if (mesh.primitives.size() > 1) name += "/" + std::to_string(job.primitive);
        result[job.mesh][job.primitive] =
            PrimitiveReader(reader, mesh.primitives[job.primitive], place).read(name);
      } catch (...) {
        job.error = std::current_exception();
      }
    }
  });
  // The first error in the order of the file, whichever thread was faster.
  for (const Job& job : jobs) {
    if (job.error) std::rethrow_exception(job.error);
  }
  return result;
}

}  // namespace catoptric::scene::gltf
