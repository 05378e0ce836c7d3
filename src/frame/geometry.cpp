#include "frame/geometry.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace catoptric::frame {
namespace {

constexpr std::size_t kVertexGrain = 8192;  ///< vertices a task copies; ours

/// Whether a triangle's winding disagrees with its vertex normals, both in object space.
bool disagreesWithNormals(const scene::Mesh& mesh, std::size_t firstIndex) {
  const std::uint32_t a = mesh.indices[firstIndex];
  const std::uint32_t b = mesh.indices[firstIndex + 1];
  const std::uint32_t c = mesh.indices[firstIndex + 2];
  const Vec3 side =
      glm::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
  return glm::dot(side, mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0.0f;
}

/// What a pose makes of an object, checked and not yet stored.
struct Posed {
  scene::WorldVertices world;
  std::optional<PlacedSurface> placed;  ///< of an implicit one that is shown whole
};

/// Makes one point of what has no area: its triangles could still cover a pixel after rounding.
void collapse(std::vector<Vec3>& positions, bool noArea) {
  Box3 box;
  for (const Vec3& p : positions) {
    box.extend(p);
    if (!noArea && !box.atMostALine()) return;
  }
  std::ranges::fill(positions, box.centre());
}

/// The longest of the cross products of a matrix's columns: the normal of the plane that the
/// columns span, or almost do.
glm::dvec3 planeNormal(const glm::dmat3& m) {
  glm::dvec3 longest(0.0);
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 across = glm::cross(m[i], m[(i + 1) % 3]);
    if (glm::length(across) > glm::length(longest)) longest = across;
  }
  return longest;
}

/// A transform that flattens keeps this share of its size as thickness, or an implicit surface has
/// no inverse placement. Below 1e-6 its two sides are no longer told apart. Ours.
constexpr double kLeastThickness = 1e-5;

/// The transform, made at least kLeastThickness thick. It leaves an area.
glm::dmat3 withThickness(const glm::dmat3& linear) {
  const glm::dvec3 normal = planeNormal(linear);
  double size = 0.0;
  for (int i = 0; i < 3; ++i) size = std::max(size, glm::length(linear[i]));
  const double thickness = glm::determinant(linear) / glm::length(normal);
  if (!(std::abs(thickness) < kLeastThickness * size)) return linear;
  const glm::dvec3 across = glm::normalize(normal);
  const glm::dvec3 flattened = glm::normalize(planeNormal(glm::transpose(linear)));
  const double sign = glm::dot(across, linear * flattened) < 0.0 ? -1.0 : 1.0;
  return linear + glm::outerProduct(sign * kLeastThickness * size * across, flattened);
}

/// Throws SceneError when the object's transform leaves the finite.
Posed posedAt(const scene::Scene& scene, const scene::Object& object, const scene::Pose& pose,
              bool hasSurface) {
  const auto where = [&] { return "object \"" + object.name + "\" of " + scene.source.string(); };
  Posed posed{scene::worldVertices(scene, object, pose), std::nullopt};
  std::atomic<bool> broken{false};
  const std::vector<Vec3>& positions = posed.world.positions;
  parallelFor(positions.size(), kVertexGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!isFinite(positions[i])) broken = true;
    }
  });
  if (broken) {
    throw SceneError(where() + ": its transform at time " + std::to_string(pose.timeSeconds) +
                     " s makes positions that are not finite; positions must stay below 1e18");
  }
  const glm::dmat4 world(scene::worldFromObject(scene, object, pose));
  const bool noArea = scene::leavesNoArea(glm::dmat3(world));
  collapse(posed.world.positions, noArea);
  if (!hasSurface) return posed;
  posed.placed.emplace();
  if (noArea) {
    posed.placed->vanishedAt = Vec3(world[3]);
    return posed;
  }
  try {
    posed.placed->surface = implicit::placed(
        *scene.meshes[object.mesh].surface, withThickness(glm::dmat3(world)), glm::dvec3(world[3]));
  } catch (const SceneError& error) {
    throw SceneError(where() + " at time " + std::to_string(pose.timeSeconds) +
                     " s: " + error.what());
  }
  return posed;
}

/// Writes what depends on the pose; returns whether a byte has changed.
bool fillVertices(Geometry& geometry, ObjectRange& range, const scene::WorldVertices& world) {
  const std::size_t count = range.vertexCount;
  const std::size_t tasks = (count + kVertexGrain - 1) / kVertexGrain;
  std::vector<Box3> boxes(tasks);
  std::vector<char> changed(tasks, 0);
  parallelFor(tasks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t task = begin; task < end; ++task) {
      const std::size_t last = std::min(count, (task + 1) * kVertexGrain);
      for (std::size_t i = task * kVertexGrain; i < last; ++i) {
        const Vec3 position = world.positions[i];
        const Vec3 normal = normalizedOr(world.normals[i], Vec3(0.0f, 1.0f, 0.0f));
        VertexAttributes& attributes = geometry.attributes[range.firstVertex + i];
        Vec3& stored = geometry.positions[range.firstVertex + i];
        Vec4 tangent = attributes.tangent;
        if (!world.tangents.empty()) {
          tangent = Vec4(normalizedOr(Vec3(world.tangents[i]), Vec3(1.0f, 0.0f, 0.0f)),
                         world.tangents[i].w);
        }
        if (stored != position || attributes.normal != normal || attributes.tangent != tangent) {
          changed[task] = 1;
        }
        stored = position;
        attributes.normal = normal;
        attributes.tangent = tangent;
        boxes[task].extend(position);
      }
    }
  });

  bool anyChanged = false;
  range.bounds = Box3{};
  for (std::size_t task = 0; task < tasks; ++task) {
    range.bounds.extend(boxes[task]);
    anyChanged = anyChanged || changed[task] != 0;
  }
  return anyChanged;
}

/// Root of (uv area / world area) over an object's triangles, summed in order in double.
float measureUvPerMetre(const Geometry& geometry, const ObjectRange& range) {
  double uvArea = 0.0;
  double worldArea = 0.0;
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; i += 3) {
    const std::uint32_t* t = &geometry.indices[i];
    const Vec2 u0 = geometry.attributes[t[0]].uv0;
    const Vec2 e1 = geometry.attributes[t[1]].uv0 - u0;
    const Vec2 e2 = geometry.attributes[t[2]].uv0 - u0;
    const Vec3 p0 = geometry.positions[t[0]];
    uvArea += std::abs(static_cast<double>(e1.x * e2.y - e1.y * e2.x));
    worldArea += static_cast<double>(
        glm::length(glm::cross(geometry.positions[t[1]] - p0, geometry.positions[t[2]] - p0)));
  }
  if (!(worldArea > 0.0) || !std::isfinite(uvArea / worldArea)) return 0.0f;
  return static_cast<float>(std::sqrt(uvArea / worldArea));
}

bool usesTextures(const scene::Scene& scene, const scene::Object& object) {
  const scene::Material& m = scene.materials[object.material];
  return m.baseColorTexture.used() || m.emissiveTexture.used() || m.normalTexture.used() ||
         m.metallicRoughnessTexture.used();
}

void placeSurface(Geometry& geometry, const ObjectRange& range,
                  std::optional<PlacedSurface> posed) {
  if (!posed) return;
  PlacedSurface& placed = geometry.surfaces[range.surface];
  posed->object = placed.object;
  placed = std::move(*posed);
  for (std::uint32_t i = range.firstIndex; i < range.firstIndex + range.indexCount; ++i) {
    const std::uint32_t next = i % 3 == 2 ? i - 2 : i + 1;
    const Vec3 edge =
        geometry.positions[geometry.indices[next]] - geometry.positions[geometry.indices[i]];
    placed.reach = std::max(placed.reach, static_cast<double>(glm::length(edge)));
  }
}

void updateBounds(Geometry& geometry) {
  geometry.bounds = Box3{};
  for (const ObjectRange& range : geometry.objects) geometry.bounds.extend(range.bounds);
}

}  // namespace

bool vanished(const Geometry& geometry, int object) {
  const ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  if (range.surface < 0) return range.bounds.atMostALine();
  return geometry.surfaces[static_cast<std::size_t>(range.surface)].vanishedAt.has_value();
}

std::uint64_t geometryBytes(const scene::Scene& scene) {
  std::uint64_t vertices = 0;
  for (const scene::Object& object : scene.objects)
    vertices += scene.meshes[static_cast<std::size_t>(object.mesh)].positions.size();
  return vertices * (sizeof(Vec3) + sizeof(VertexAttributes)) +
         scene.triangleCount() * 3 * sizeof(std::uint32_t);
}

Geometry makeGeometry(const scene::Scene& scene, const scene::Pose& pose) {
  Geometry geometry;
  geometry.timeSeconds = pose.timeSeconds;
  const std::vector<bool> moving = scene::movingObjects(scene);
  const std::vector<bool> deforming = scene::deformingObjects(scene);

  // Give every object its range.
  std::size_t vertices = 0;
  std::size_t indices = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Mesh& mesh = scene.meshes[scene.objects[i].mesh];
    ObjectRange range;
    range.firstVertex = static_cast<std::uint32_t>(vertices);
    range.vertexCount = static_cast<std::uint32_t>(mesh.positions.size());
    range.firstIndex = static_cast<std::uint32_t>(indices);
    range.indexCount = static_cast<std::uint32_t>(mesh.indices.size());
    range.moving = moving[i];
    range.deforms = deforming[i];
    const bool cut = scene.materials[scene.objects[i].material].alphaMode == scene::AlphaMode::Mask;
    if (mesh.surface && !cut) {
      range.surface = static_cast<int>(geometry.surfaces.size());
      geometry.surfaces.emplace_back().object = static_cast<int>(i);
    }
    geometry.objects.push_back(range);
    vertices += mesh.positions.size();
    indices += mesh.indices.size();
  }
  constexpr std::size_t kLimit = std::numeric_limits<std::uint32_t>::max();
  if (vertices >= kLimit || indices >= kLimit) {
    throw SceneError(scene.source.string() + ": " + std::to_string(vertices) + " vertices and " +
                     std::to_string(indices) +
                     " indices, counting all instances; the limit of each is 4294967294");
  }
  geometry.positions.resize(vertices + 1, Vec3(0.0f));
  geometry.attributes.resize(vertices);
  geometry.indices.resize(indices);

  // Fill what never changes, then what the pose gives.
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const scene::Object& object = scene.objects[o];
    const scene::Mesh& mesh = scene.meshes[object.mesh];
    ObjectRange& range = geometry.objects[o];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      VertexAttributes& attributes = geometry.attributes[range.firstVertex + i];
      if (!mesh.uv[0].empty()) attributes.uv0 = mesh.uv[0][i];
      if (!mesh.uv[1].empty()) attributes.uv1 = mesh.uv[1][i];
      if (!mesh.colors.empty()) attributes.color = mesh.colors[i];
    }
    Posed posed = posedAt(scene, object, pose, range.surface >= 0);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      std::uint32_t* triangle = &geometry.indices[range.firstIndex + i];
      for (int k = 0; k < 3; ++k) triangle[k] = range.firstVertex + mesh.indices[i + k];
      if (disagreesWithNormals(mesh, i) != posed.world.flipWinding)
        std::swap(triangle[1], triangle[2]);
    }
    fillVertices(geometry, range, posed.world);
    range.worldFromObject = scene::worldFromObject(scene, object, pose);
    placeSurface(geometry, range, std::move(posed.placed));
    if (usesTextures(scene, object)) range.uvPerMetre = measureUvPerMetre(geometry, range);
  }
  updateBounds(geometry);
  return geometry;
}

std::vector<int> updateGeometry(Geometry& geometry, const scene::Scene& scene,
                                const scene::Pose& pose) {
  // All of it is checked before any is stored: after a frame that fails, what moved meanwhile must
  // still differ from what is stored
  std::vector<Posed> posed;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const ObjectRange& range = geometry.objects[o];
    if (range.moving) posed.push_back(posedAt(scene, scene.objects[o], pose, range.surface >= 0));
  }

  geometry.timeSeconds = pose.timeSeconds;
  std::vector<int> changed;
  auto next = posed.begin();
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    ObjectRange& range = geometry.objects[o];
    if (!range.moving) continue;
    Posed& object = *next++;
    range.worldFromObject = scene::worldFromObject(scene, scene.objects[o], pose);
    if (!fillVertices(geometry, range, object.world)) continue;
    placeSurface(geometry, range, std::move(object.placed));
    if (usesTextures(scene, scene.objects[o]))
      range.uvPerMetre = measureUvPerMetre(geometry, range);
    changed.push_back(static_cast<int>(o));
  }
  updateBounds(geometry);
  return changed;
}

}  // namespace catoptric::frame
