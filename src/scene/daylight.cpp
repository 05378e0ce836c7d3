#include "scene/daylight.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/animate.h"
#include "scene/finish.h"
#include "scene/finish_steps.h"
#include "scene/subdivide.h"

namespace catoptric::scene {
namespace {

// All numbers are our choice, made by looking at eight models.
/// Of the sky beside a sun, relative to a sky alone.
constexpr float kSkyScale = 0.6f;
/// Of the sun, W/m^2: with the sky, a white surface that faces the sun has a radiance of about 1.2.
constexpr float kSunIrradiance = 2.0f;
/// From the upper left before the scene, 52 degrees above the horizon.
constexpr Vec3 kSunDirection{0.5f, -1.0f, -0.6f};
/// Of the sun's disk, radians: its shadows are as soft as cells of the ground allow.
constexpr float kSunRadius = 0.03f;
constexpr int kBakeRays = 96;
/// One more than in a description: the first one brings only the light of sky and sun.
constexpr int kBakeGathers = 3;

/// Longest edge of a triangle with baked light, in diameters of the scene; longer where more than
/// kMostAdded triangles would be added.
constexpr double kLongestShare = 0.02;
constexpr double kMostAdded = 60'000.0;
/// Triangles per longest edge squared of their area.
constexpr double kTrianglesPerArea = 3.5;
/// Triangles per longest edge along a long and thin triangle.
constexpr double kTrianglesPerLength = 3.0;

/// Cells of the ground below the scene and its shadow, along each axis.
constexpr int kGroundCells = 128;
/// Cells beyond it grow by this factor, up to kGroundReach diameters of the scene.
constexpr float kGroundGrowth = 1.2f;
constexpr float kGroundReach = 50.0f;
/// Gap below the lowest point, in diameters.
constexpr float kGroundGap = 1e-3f;
constexpr float kGroundAlbedo = 0.5f;
constexpr float kMirrorLevel = 0.5f;

/// A triangle of a mesh, scaled as its objects are.
struct Extent {
  double area = 0.0;
  double longest = 0.0;  ///< edge
  double objects = 0.0;  ///< that have it
};

/// About as many triangles as are added if no edge stays longer than `longest`.
double trianglesAdded(const std::vector<Extent>& triangles, double longest) {
  double added = 0.0;
  for (const Extent& t : triangles) {
    if (t.longest <= longest) continue;
    added += t.objects * (std::max(kTrianglesPerArea * t.area / (longest * longest),
                                   kTrianglesPerLength * t.longest / longest) -
                          1.0);
  }
  return added;
}

/// Halves long edges, so that vertices resolve shadows.
void refineMeshes(Scene& scene) {
  const Pose pose = poseAt(scene, 0.0);
  struct Use {
    Vec3 scale{0.0f};  ///< along the mesh's axes, the largest of its objects
    double objects = 0.0;
  };
  std::vector<Use> uses(scene.meshes.size());
  for (const Object& object : scene.objects) {
    const Mat3 linear(worldFromObject(scene, object, pose));
    Use& use = uses[index(object.mesh)];
    for (int axis = 0; axis < 3; ++axis)
      use.scale[axis] = std::max(use.scale[axis], glm::length(linear[axis]));
    ++use.objects;
  }
  std::vector<Extent> triangles;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    const auto place = [&](std::size_t i) {
      return glm::dvec3(uses[m].scale * mesh.positions[mesh.indices[i]]);
    };
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const glm::dvec3 ab = place(i + 1) - place(i);
      const glm::dvec3 ac = place(i + 2) - place(i);
      triangles.push_back({0.5 * glm::length(glm::cross(ab, ac)),
                           std::max({glm::length(ab), glm::length(ac), glm::length(ac - ab)}),
                           uses[m].objects});
    }
  }
  double longest = kLongestShare * static_cast<double>(boundsAtStart(scene).diameter());
  if (!(longest > 0.0) || !std::isfinite(longest)) return;
  while (trianglesAdded(triangles, longest) > kMostAdded) longest *= 1.25;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m)
    subdivide(scene.meshes[m], uses[m].scale, static_cast<float>(longest));
}

void bakeAll(Scene& scene) {
  for (Light& light : scene.lights) light.baked = true;
  scene.bake = {
      .mode = BakeMode::Full, .rays = kBakeRays, .bounces = kBakeGathers, .skyApart = true};
  const std::size_t before = scene.triangleCount();
  refineMeshes(scene);
  if (scene.triangleCount() > before)
    addNote(scene, fmt::format("{} triangles were split into {}, so that their vertices resolve "
                               "the baked light",
                               before, scene.triangleCount()));
}

/// Places along one axis: even over [low, high], then ever farther apart.
std::vector<float> gridLines(float low, float high, float reach) {
  const float cell = (high - low) / static_cast<float>(kGroundCells);
  std::vector<float> outside;
  float step = cell;
  for (float away = cell; away < reach; away += step) {
    outside.push_back(away);
    step *= kGroundGrowth;
  }
  outside.push_back(reach);
  std::vector<float> lines;
  for (auto away = outside.rbegin(); away != outside.rend(); ++away) lines.push_back(low - *away);
  for (int i = 0; i <= kGroundCells; ++i) lines.push_back(low + cell * static_cast<float>(i));
  for (const float away : outside) lines.push_back(high + away);
  return lines;
}

/// The same lines, but for the border half a cell farther on: where they stand in every other row.
std::vector<float> shifted(const std::vector<float>& lines) {
  std::vector<float> result{lines.front()};
  for (std::size_t i = 0; i + 1 < lines.size(); ++i)
    result.push_back(0.5f * (lines[i] + lines[i + 1]));
  result.push_back(lines.back());
  return result;
}

/// Cells that are all cut along one diagonal would hatch the edges of shadows that cross it, so
/// every other row is shifted.
Mesh groundMesh(const Box3& bounds) {
  const float diameter = bounds.diameter();
  const float margin = std::max(0.6f * (bounds.max.y - bounds.min.y), 0.05f * diameter);
  const float reach = kGroundReach * diameter;
  const std::vector<float> even = gridLines(bounds.min.x - margin, bounds.max.x + margin, reach);
  const std::vector<float> odd = shifted(even);
  const std::vector<float> z = gridLines(bounds.min.z - margin, bounds.max.z + margin, reach);
  Mesh mesh;
  mesh.name = "ground";
  const float y = bounds.min.y - kGroundGap * diameter;
  for (std::size_t row = 0; row < z.size(); ++row) {
    const auto next = static_cast<std::uint32_t>(mesh.positions.size());
    for (const float px : row % 2 == 0 ? even : odd) mesh.positions.emplace_back(px, y, z[row]);
    if (row == 0) continue;
    // The even row has a corner between any two of the odd one
    const auto corners = static_cast<std::uint32_t>(even.size());
    const bool down = row % 2 == 1;  // from an even row to an odd one
    const std::uint32_t e = down ? next - corners : next;
    const std::uint32_t o = down ? next : next - corners - 1;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      mesh.indices.insert(mesh.indices.end(), {a, down ? b : c, down ? c : b});
    };
    for (std::uint32_t k = 0; k < corners; ++k) {
      add(o + k, o + k + 1, e + k);
      if (k + 1 < corners) add(e + k, o + k + 1, e + k + 1);
    }
  }
  mesh.normals.assign(mesh.positions.size(), Vec3(0.0f, 1.0f, 0.0f));
  return mesh;
}

}  // namespace

Environment defaultEnvironment() {
  Environment sky;
  sky.type = EnvironmentType::Gradient;
  sky.color = Vec3(0.75f, 0.87f, 1.0f);
  sky.horizon = Vec3(1.0f, 1.0f, 1.0f);
  sky.ground = Vec3(0.3f, 0.28f, 0.26f);
  sky.isDefault = true;
  return sky;
}

void addDaylight(Scene& scene) {
  scene.environment = defaultEnvironment();
  scene.environment.scale = kSkyScale;
  Light sun;
  sun.name = "sun";
  sun.type = LightType::Directional;
  sun.intensity = Vec3(kSunIrradiance);
  sun.direction = glm::normalize(kSunDirection);
  sun.radius = kSunRadius;
  scene.lights.push_back(sun);
  finishMeshes(scene);
  if (!scene.animated()) bakeAll(scene);
}

void addGround(Scene& scene, Ground ground) {
  if (ground == Ground::None) return;
  finishMeshes(scene);
  const Box3 bounds = boundsAtStart(scene);
  if (!(bounds.diameter() > 0.0f)) return;
  if (scene.bake.mode == BakeMode::None) bakeAll(scene);
  if (scene.animated())
    scene.warnings.emplace_back(
        "light is baked for the ground, so moving objects keep the light of time 0 and cast no "
        "shadow");
  Material material;
  material.name = "ground";
  material.baseColor = Vec3(kGroundAlbedo);
  setReflectance(material, ground == Ground::Mirror ? kMirrorLevel : 0.0f, 0.0f);
  Object object;
  object.name = "ground";
  object.mesh = static_cast<int>(scene.meshes.size());
  object.material = static_cast<int>(scene.materials.size());
  scene.ground = static_cast<int>(scene.objects.size());
  scene.meshes.push_back(groundMesh(bounds));
  scene.materials.push_back(std::move(material));
  scene.objects.push_back(std::move(object));
}

}  // namespace catoptric::scene
