#include "raster/meshlets.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cstring>
#include <unordered_map>

#include "core/parallel.h"

namespace catoptric::raster {
namespace {

constexpr std::size_t kMaxVertices = 64;
constexpr std::size_t kMaxTriangles = 124;  // a multiple of 4, as meshoptimizer asks
constexpr float kConeWeight = 0.25f;        // ours: some preference for flat meshlets
/// Bounds are widened by this share against rounding in their own computation. Ours.
constexpr float kBoundsSlack = 1e-5f;

/// Sphere about the box of the meshlet's vertices, and meshoptimizer's cone of normals.
void computeBounds(Meshlet& meshlet, std::span<const std::uint32_t> indices,
                   const frame::Geometry& geometry) {
  Box3 box;
  for (const std::uint32_t index : indices) box.extend(geometry.positions[index]);
  meshlet.centre = box.centre();
  float radius2 = 0.0f;
  for (const std::uint32_t index : indices) {
    const Vec3 offset = geometry.positions[index] - meshlet.centre;
    radius2 = std::max(radius2, glm::dot(offset, offset));
  }
  const float scale = std::max(glm::length(box.min), glm::length(box.max));
  meshlet.radius = std::sqrt(radius2) + kBoundsSlack * (std::sqrt(radius2) + scale);

  // The cone of the triangles' normals about their mean
  Vec3 sum(0.0f);
  const auto normalOf = [&](std::size_t i) {
    const Vec3& a = geometry.positions[indices[i]];
    const Vec3& b = geometry.positions[indices[i + 1]];
    const Vec3& c = geometry.positions[indices[i + 2]];
    return normalizedOr(glm::cross(b - a, c - a), Vec3(0.0f));
  };
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) sum += normalOf(i);
  const Vec3 axis = normalizedOr(sum, Vec3(0.0f));
  float least = 1.0f;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    const Vec3 normal = normalOf(i);
    if (normal != Vec3(0.0f)) least = std::min(least, glm::dot(normal, axis));
  }
  meshlet.coneAxis = axis;
  // All normals within angle a of the axis: backs are seen where the view direction lies within
  // 90 - a degrees of the axis, cos(90 - a) = sin(a).
  meshlet.coneCutoff =
      axis == Vec3(0.0f) || least <= 0.1f ? 2.0f : std::sqrt(1.0f - least * least) + kBoundsSlack;
}

/// Whether the object's triangles make closed, consistently wound surfaces, each part with
/// outward normals (positive volume). Vertices with the same position are one.
bool isClosedOutward(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  if (range.indexCount < 12) return false;

  // Weld vertices by position
  struct PositionHash {
    std::size_t operator()(const std::array<std::uint32_t, 3>& p) const {
      return (p[0] * std::size_t{73856093}) ^ (p[1] * std::size_t{19349663}) ^
             (p[2] * std::size_t{83492791});
    }
  };
  std::unordered_map<std::array<std::uint32_t, 3>, std::uint32_t, PositionHash> known;
  known.reserve(range.vertexCount);
  std::vector<std::uint32_t> welded(range.vertexCount);
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
    const Vec3 p = geometry.positions[range.firstVertex + i] + Vec3(0.0f);  // -0 becomes 0
    std::array<std::uint32_t, 3> bits;
    std::memcpy(bits.data(), &p, sizeof bits);
    welded[i] = known.try_emplace(bits, i).first->second;
  }

  // Every directed edge once, and its opposite once; parts by union-find
  std::vector<std::uint32_t> parent(range.vertexCount);
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) parent[i] = i;
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<std::uint64_t> edges;
  edges.reserve(range.indexCount);
  const auto vertex = [&](std::uint32_t i) {
    return welded[geometry.indices[range.firstIndex + i] - range.firstVertex];
  };
  for (std::uint32_t i = 0; i < range.indexCount; i += 3) {
    const std::array<std::uint32_t, 3> v{vertex(i), vertex(i + 1), vertex(i + 2)};
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;  // covers nothing
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t from = v[k];
      const std::uint64_t to = v[(k + 1) % 3];
      edges.push_back(from << 32 | to);
      parent[root(v[k])] = root(v[(k + 1) % 3]);
    }
  }
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  for (const std::uint64_t edge : edges) {
    const std::uint64_t opposite = edge << 32 | edge >> 32;
    if (!std::binary_search(edges.begin(), edges.end(), opposite)) return false;
  }

  // Volume of each part
  std::unordered_map<std::uint32_t, double> volume;
  for (std::uint32_t i = 0; i < range.indexCount; i += 3) {
    const std::uint32_t* triangle = &geometry.indices[range.firstIndex + i];
    const glm::dvec3 a(geometry.positions[triangle[0]] - range.bounds.min);
    const glm::dvec3 b(geometry.positions[triangle[1]] - range.bounds.min);
    const glm::dvec3 c(geometry.positions[triangle[2]] - range.bounds.min);
    volume[root(vertex(i))] += glm::dot(a, glm::cross(b, c));
  }
  return std::all_of(volume.begin(), volume.end(),
                     [](const auto& part) { return part.second > 0.0; });
}

/// One object's meshlets, with indices from 0.
struct ObjectMeshlets {
  std::vector<std::uint32_t> indices;
  std::vector<Meshlet> meshlets;
  bool closed = false;
};

ObjectMeshlets buildObject(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  ObjectMeshlets result;
  if (range.indexCount == 0) return result;
  std::vector<std::uint32_t> local(range.indexCount);
  for (std::uint32_t i = 0; i < range.indexCount; ++i) {
    local[i] = geometry.indices[range.firstIndex + i] - range.firstVertex;
  }
  const std::size_t bound =
      meshopt_buildMeshletsBound(range.indexCount, kMaxVertices, kMaxTriangles);
  std::vector<meshopt_Meshlet> built(bound);
  std::vector<unsigned int> vertices(bound * kMaxVertices);
  std::vector<unsigned char> triangles(bound * kMaxTriangles * 3);
  const std::size_t count = meshopt_buildMeshlets(
      built.data(), vertices.data(), triangles.data(), local.data(), local.size(),
      &geometry.positions[range.firstVertex].x, range.vertexCount, sizeof(Vec3), kMaxVertices,
      kMaxTriangles, kConeWeight);
  result.indices.reserve(range.indexCount);
  for (std::size_t m = 0; m < count; ++m) {
    Meshlet meshlet;
    meshlet.firstIndex = static_cast<std::uint32_t>(result.indices.size());
    meshlet.indexCount = built[m].triangle_count * 3;
    for (std::uint32_t i = 0; i < meshlet.indexCount; ++i) {
      result.indices.push_back(
          range.firstVertex +
          vertices[built[m].vertex_offset + triangles[built[m].triangle_offset + i]]);
    }
    computeBounds(meshlet,
                  std::span(result.indices).subspan(meshlet.firstIndex, meshlet.indexCount),
                  geometry);
    result.meshlets.push_back(meshlet);
  }
  result.closed = isClosedOutward(geometry, range);
  return result;
}

}  // namespace

Meshlets buildMeshlets(const frame::Geometry& geometry) {
  std::vector<ObjectMeshlets> objects(geometry.objects.size());
  parallelFor(objects.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      objects[i] = buildObject(geometry, geometry.objects[i]);
    }
  });

  Meshlets result;
  result.indices.resize(geometry.indices.size());
  result.firstOfObject.push_back(0);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::uint32_t first = geometry.objects[i].firstIndex;
    std::copy(objects[i].indices.begin(), objects[i].indices.end(), result.indices.begin() + first);
    for (Meshlet meshlet : objects[i].meshlets) {
      meshlet.firstIndex += first;
      result.meshlets.push_back(meshlet);
    }
    result.firstOfObject.push_back(static_cast<std::uint32_t>(result.meshlets.size()));
    result.closed.push_back(objects[i].closed);
  }
  return result;
}

void updateMeshletBounds(Meshlets& meshlets, const frame::Geometry& geometry, int object) {
  for (std::uint32_t m = meshlets.firstOfObject[object]; m < meshlets.firstOfObject[object + 1];
       ++m) {
    Meshlet& meshlet = meshlets.meshlets[m];
    computeBounds(meshlet,
                  std::span(meshlets.indices).subspan(meshlet.firstIndex, meshlet.indexCount),
                  geometry);
  }
}

Frustum::Frustum(const Mat4& clipFromWorld) {
  const Mat4 rows = glm::transpose(clipFromWorld);
  planes_ = {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1],
             rows[3] - rows[1], rows[3] - rows[2], rows[2]};
  for (Vec4& plane : planes_) {
    const float length = glm::length(Vec3(plane));
    plane = length > 0.0f ? plane / length : Vec4(0.0f, 0.0f, 0.0f, 1.0f);
  }
}

bool Frustum::mayContain(const Vec3& centre, float radius) const {
  return std::all_of(planes_.begin(), planes_.end(), [&](const Vec4& plane) {
    // Rounding of the planes grows with the distance from the origin
    const float slack = kBoundsSlack * (std::abs(plane.w) + glm::length(centre));
    return glm::dot(Vec3(plane), centre) + plane.w >= -radius - slack;
  });
}

bool Frustum::mayContain(const Box3& box) const {
  if (box.empty()) return false;
  return std::all_of(planes_.begin(), planes_.end(), [&](const Vec4& plane) {
    const Vec3 corner(plane.x > 0.0f ? box.max.x : box.min.x,
                      plane.y > 0.0f ? box.max.y : box.min.y,
                      plane.z > 0.0f ? box.max.z : box.min.z);
    const float slack = kBoundsSlack * (std::abs(plane.w) + glm::length(corner));
    return glm::dot(Vec3(plane), corner) + plane.w >= -slack;
  });
}

}  // namespace catoptric::raster
