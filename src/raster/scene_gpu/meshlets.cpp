#include "raster/scene_gpu/meshlets.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "core/welding.h"

namespace catoptric::raster {
namespace {

/// 64 triangles: fewer cost the culling more than they save the drawing. Ours, measured in the
/// living room.
constexpr std::uint32_t kMaxIndices = 3 * kMeshletTriangles;
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

/// Well-mixed bits of a number (the finalizer of splitmix64).
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// Whether the object's triangles make closed, consistently wound surfaces, each part with
/// outward normals (positive volume). Vertices with the same position are one.
bool isClosedOutward(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  if (range.indexCount < 12) return false;
  Welding welding;
  welding.weld(range.vertexCount, [&](std::size_t v) {
    return std::array{geometry.positions[range.firstVertex + v]};
  });
  const auto vertex = [&](std::uint32_t i) {
    return welding.numbers[geometry.indices[range.firstIndex + i] - range.firstVertex];
  };

  // Closed: each directed edge occurs as often as its opposite. Sums of hashes stand for the two
  // multisets (they are equal by chance once in 2^64).
  std::uint64_t forward = 0;
  std::uint64_t backward = 0;
  for (std::uint32_t i = 0; i < range.indexCount; i += 3) {
    const std::array<std::uint64_t, 3> v{vertex(i), vertex(i + 1), vertex(i + 2)};
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t from = v[k];
      const std::uint64_t to = v[(k + 1) % 3];
      forward += mixed(from << 32 | to);
      backward += mixed(to << 32 | from);
    }
  }
  if (forward != backward) return false;

  // Parts that hang together, and the volume of each
  std::vector<std::uint32_t> parent(range.vertexCount);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::uint32_t i = 0; i < range.indexCount; i += 3) {
    parent[root(vertex(i))] = root(vertex(i + 1));
    parent[root(vertex(i + 1))] = root(vertex(i + 2));
  }
  std::vector<double> volume(range.vertexCount, 0.0);
  std::vector<bool> isPart(range.vertexCount, false);
  for (std::uint32_t i = 0; i < range.indexCount; i += 3) {
    const std::uint32_t* triangle = &geometry.indices[range.firstIndex + i];
    const glm::dvec3 a(geometry.positions[triangle[0]] - range.bounds.min);
    const glm::dvec3 b(geometry.positions[triangle[1]] - range.bounds.min);
    const glm::dvec3 c(geometry.positions[triangle[2]] - range.bounds.min);
    const std::uint32_t part = root(vertex(i));
    volume[part] += glm::dot(a, glm::cross(b, c));
    isPart[part] = true;
  }
  for (std::uint32_t i = 0; i < range.vertexCount; ++i) {
    if (isPart[i] && !(volume[i] > 0.0)) return false;
  }
  return true;
}

ObjectMeshlets buildObject(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  ObjectMeshlets result;
  if (range.indexCount == 0) return result;
  appendMeshlets(geometry, range, localIndices(geometry, range), result);
  result.closed = isClosedOutward(geometry, range);
  return result;
}

}  // namespace

std::vector<std::uint32_t> localIndices(const frame::Geometry& geometry,
                                        const frame::ObjectRange& range) {
  std::vector<std::uint32_t> local(range.indexCount);
  for (std::uint32_t i = 0; i < range.indexCount; ++i) {
    local[i] = geometry.indices[range.firstIndex + i] - range.firstVertex;
  }
  return local;
}

void appendMeshlets(const frame::Geometry& geometry, const frame::ObjectRange& range,
                    std::span<const std::uint32_t> local, ObjectMeshlets& result) {
  const std::size_t start = result.indices.size();
  result.indices.resize(start + local.size());
  const std::span<std::uint32_t> sorted = std::span(result.indices).subspan(start);
  meshopt_spatialSortTriangles(sorted.data(), local.data(), local.size(),
                               &geometry.positions[range.firstVertex].x, range.vertexCount,
                               sizeof(Vec3));
  for (std::uint32_t& index : sorted) index += range.firstVertex;
  for (std::size_t first = 0; first < sorted.size(); first += kMaxIndices) {
    Meshlet meshlet;
    meshlet.firstIndex = static_cast<std::uint32_t>(start + first);
    meshlet.indexCount =
        static_cast<std::uint32_t>(std::min<std::size_t>(kMaxIndices, sorted.size() - first));
    computeBounds(meshlet, sorted.subspan(first, meshlet.indexCount), geometry);
    result.meshlets.push_back(meshlet);
  }
}

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
    result.closed.push_back(objects[i].closed && !geometry.objects[i].moving);
  }
  return result;
}

void updateBounds(std::span<Meshlet> meshlets, std::span<const std::uint32_t> indices,
                  const frame::Geometry& geometry) {
  for (Meshlet& meshlet : meshlets) {
    computeBounds(meshlet, indices.subspan(meshlet.firstIndex, meshlet.indexCount), geometry);
  }
}

void updateMeshletBounds(Meshlets& meshlets, const frame::Geometry& geometry, int object) {
  const std::uint32_t first = meshlets.firstOfObject[object];
  updateBounds(
      std::span(meshlets.meshlets).subspan(first, meshlets.firstOfObject[object + 1] - first),
      meshlets.indices, geometry);
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
