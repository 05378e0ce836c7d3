#include "scene/finish.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/parallel.h"
#include "scene/animate.h"
#include "scene/finish_steps.h"
#include "scene/reflectance.h"

namespace catoptric::scene {
namespace {

/// A vertex farther from the plane than this share of the mesh's diameter, or a normal farther from
/// the plane's than this cosine (0.8 degrees: normals in bytes are that coarse), makes a mesh
/// curved. Ours.
constexpr float kPlanarDistance = 1e-5f;
constexpr float kPlanarCosine = 0.9999f;

/// Longer edges of triangles are warned of, metres: single precision is a metre apart there, the
/// height of an eye above the ground. Ours; llvmpipe shows a floor of 1e8 m and none of 2e8 m.
constexpr double kLongestEdge = 1e7;

// ---- Reflection ----

/// Largest value of one channel over a texture's image, 0..1.
float largestTexel(const Texture& texture, std::size_t channel) {
  if (texture.levels.empty()) return 1.0f;
  std::uint8_t largest = 0;
  const std::vector<std::uint8_t>& rgba = texture.levels.front().rgba;
  for (std::size_t i = channel; i < rgba.size(); i += 4) largest = std::max(largest, rgba[i]);
  return static_cast<float>(largest) / 255.0f;
}

/// By material: whether it colours vertices of any mesh.
std::vector<char> vertexColoured(const Scene& scene) {
  std::vector<char> coloured(scene.materials.size(), 0);
  for (const Object& object : scene.objects) {
    const std::vector<Vec3>& colors = scene.meshes[index(object.mesh)].colors;
    if (std::any_of(colors.begin(), colors.end(), [](const Vec3& c) { return c != Vec3(1.0f); }))
      coloured[index(object.material)] = 1;
  }
  return coloured;
}

/// A tint that is the same everywhere becomes one colour.
void finishTint(Material& m, bool vertexColours) {
  if (m.specularLevel > 0.0f && (m.baseColorTexture.used() || vertexColours)) return;
  const bool grey = m.dielectricF0 == Vec3(m.dielectricF0.x);
  const bool white = m.baseColor == Vec3(1.0f) && grey;
  if (m.specularLevel > 0.0f && m.metallicRoughnessTexture.used() &&
      !(white && m.dielectricF90 == 1.0f))
    return;
  m.reflectionTint =
      white && m.albedoTint > 0.0f ? Vec3(1.0f) : m.reflectionTint + m.albedoTint * m.baseColor;
  m.albedoTint = 0.0f;
}

/// s and g by scene/reflectance.h. With a texture the largest s and g of any texel stand for the
/// material: an object whose texture makes any part reflect is a reflector.
void setLargestReflection(const Scene& scene, Material& m) {
  float metallic = m.metallicFactor;
  m.roughness = m.roughnessFactor;
  if (m.metallicRoughnessTexture.used()) {
    const Texture& texture = scene.textures[index(m.metallicRoughnessTexture.texture)];
    metallic *= largestTexel(texture, 2);
    m.roughness *= largestTexel(texture, 1);
  }
  m.specularLevel = specularLevel(metallic, m.dielectricF0);
}

/// Sets s and g, unless a loader has set them already.
void finishMaterial(const Scene& scene, Material& m) {
  if (m.unlit) {
    m.specularLevel = 0.0f;
    m.roughness = 0.0f;
    return;
  }
  if (m.specularLevel <= 0.0f) {
    setLargestReflection(scene, m);
    if (m.specularLevel < kReflectiveThreshold) {
      m.specularLevel = 0.0f;
      m.roughness = 0.0f;
    }
  }
  m.specularLevel = std::min(m.specularLevel, 1.0f);
  m.roughness = std::clamp(m.roughness, 0.0f, 1.0f);
}

/// All vertices in one plane, with its normal, for good.
bool isPlanar(const Mesh& mesh) {
  if (mesh.positions.empty() || !mesh.morphTargets.empty() || !mesh.joints.empty()) return false;
  Box3 box;
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    box.extend(mesh.positions[i]);
    sum += glm::dvec3(mesh.normals[i]);
  }
  const float diameter = box.diameter();
  const Vec3 n = normalizedOr(Vec3(sum), Vec3(0.0f));
  if (!(diameter > 0.0f) || n == Vec3(0.0f)) return false;
  const Vec3& origin = mesh.positions.front();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (std::abs(glm::dot(mesh.positions[i] - origin, n)) > kPlanarDistance * diameter)
      return false;
    if (glm::dot(mesh.normals[i], n) < kPlanarCosine) return false;
  }
  return true;
}

void finishObjects(Scene& scene) {
  std::vector<char> planar(scene.meshes.size(), 0);
  parallelFor(scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) planar[m] = isPlanar(scene.meshes[m]) ? 1 : 0;
  });
  int reflectors = 0;
  for (Object& object : scene.objects) {
    const Material& material = scene.materials[index(object.material)];
    object.reflector = material.specularLevel > 0.0f ? ++reflectors : 0;
    object.planar = planar[index(object.mesh)] != 0 && !material.normalTexture.used();
  }
}

// ---- Where it stands ----

/// Far scenes get an origin of their own: where the middle lies more than kFarDiameters from 0,
/// floats would be coarser than a 1e-5th of the scene.
constexpr double kFarDiameters = 64.0;  // ours
/// Objects with a diameter of fewer floats' spacings are warned of: a hundredth of it is lost.
/// Ours.
constexpr double kLeastSpacings = 100.0;

/// World-space boxes of all objects at time 0.
std::vector<Box3> boundsOfObjects(const Scene& scene) {
  std::vector<Box3> boxes(scene.meshes.size());
  for (std::size_t m = 0; m < boxes.size(); ++m) {
    for (const Vec3& p : scene.meshes[m].positions) boxes[m].extend(p);
  }
  const Pose pose = poseAt(scene, 0.0);
  std::vector<Box3> bounds(scene.objects.size());
  for (std::size_t o = 0; o < bounds.size(); ++o) {
    const Object& object = scene.objects[o];
    const Box3& box = boxes[index(object.mesh)];
    if (box.empty()) continue;
    if (!scene.meshes[index(object.mesh)].joints.empty()) {
      for (const Vec3& p : worldVertices(scene, object, pose).positions) bounds[o].extend(p);
      continue;
    }
    const Mat4 m = (object.node == kNone ? Mat4(1.0f) : pose.worldFromNode[index(object.node)]) *
                   object.nodeFromInstance;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p((corner & 1) != 0 ? box.max.x : box.min.x,
                   (corner & 2) != 0 ? box.max.y : box.min.y,
                   (corner & 4) != 0 ? box.max.z : box.min.z);
      bounds[o].extend(Vec3(m * Vec4(p, 1.0f)));
    }
  }
  return bounds;
}

double largestCoordinate(const glm::dvec3& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

glm::dvec3 originOf(const std::vector<Box3>& objects) {
  Box3 bounds;
  for (const Box3& box : objects) {
    if (!box.empty()) bounds.extend(box);
  }
  const double diameter = bounds.diameter();
  const glm::dvec3 centre(bounds.centre());
  if (!(diameter > 0.0) || !std::isfinite(diameter) ||
      largestCoordinate(centre) <= kFarDiameters * diameter) {
    return glm::dvec3(0.0);
  }
  // A power of two's multiple: what was exact stays exact
  const double unit = std::exp2(std::ceil(std::log2(diameter)));
  return glm::round(centre / unit) * unit;
}

/// Of the objects that floats cannot hold where they stand, a warning of the worst.
void warnOfLostShapes(Scene& scene, const std::vector<Box3>& bounds) {
  int lost = 0;
  double worst = kLeastSpacings;
  std::string what;
  for (std::size_t o = 0; o < bounds.size(); ++o) {
    const double size = bounds[o].diameter();
    if (!(size > 0.0) || !std::isfinite(size)) continue;
    const double away = std::max(largestCoordinate(glm::dvec3(bounds[o].min) - scene.origin),
                                 largestCoordinate(glm::dvec3(bounds[o].max) - scene.origin));
    const double spacing = away * std::numeric_limits<float>::epsilon();
    if (size >= kLeastSpacings * spacing) continue;
    ++lost;
    if (size / spacing >= worst) continue;
    worst = size / spacing;
    what = fmt::format(
        "\"{}\" is {:.2g} m large and lies {:.2g} m from the scene's origin, where its corners are "
        "rounded to about {:.2g} m",
        scene.objects[o].name, size, away, spacing);
  }
  if (lost == 0) return;
  scene.warnings.push_back(
      what + (lost > 1 ? " (the worst of " + std::to_string(lost) + " such objects)" : "") +
      "; it is too small for its distance from the origin (precision of floats): remove it, move "
      "it nearer, or move the scene's centre to the origin");
}

double longestEdge(const Scene& scene, const Object& object) {
  const WorldVertices world = worldVertices(scene, object, poseAt(scene, 0.0));
  const std::vector<std::uint32_t>& indices = scene.meshes[index(object.mesh)].indices;
  double longest = 0.0;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    const glm::dvec3 edge =
        glm::dvec3(world.positions[indices[i]]) - glm::dvec3(world.positions[indices[next]]);
    longest = std::max(longest, glm::length(edge));
  }
  return longest;
}

/// A rasterizer knows a triangle by its corners alone, in clip space: where they are far away, what
/// lies near the camera is rounded as they are, and the triangle may be lost.
void warnOfLongEdges(Scene& scene, const std::vector<Box3>& bounds) {
  for (std::size_t o = 0; o < bounds.size(); ++o) {
    if (!(bounds[o].diameter() > kLongestEdge)) continue;
    const double edge = longestEdge(scene, scene.objects[o]);
    if (!(edge > kLongestEdge)) continue;
    scene.warnings.push_back(
        fmt::format("\"{}\" has a triangle with an edge of {:.2g} m: methods that rasterize place "
                    "it only to about {:.2g} m, and may not draw it at all; make it smaller (a "
                    "plane of 1e+06 m reaches the same horizon), or subdivide it",
                    scene.objects[o].name, edge, edge * std::numeric_limits<float>::epsilon()));
    return;
  }
}

/// Objects that no ray can hit; those that move may be hidden by a scale of 0 for a while.
void warnOfNoExtent(Scene& scene, const std::vector<Box3>& bounds) {
  const std::vector<bool> moving = movingObjects(scene);
  const Pose pose = poseAt(scene, 0.0);
  std::size_t none = 0;
  std::string first;
  for (std::size_t o = 0; o < bounds.size(); ++o) {
    if (moving[o] || bounds[o].empty()) continue;
    const glm::dmat4 world(worldFromObject(scene, scene.objects[o], pose));
    if (!bounds[o].atMostALine() && !leavesNoArea(glm::dmat3(world))) continue;
    if (none++ == 0) first = scene.objects[o].name;
  }
  if (none == 0) return;
  scene.warnings.push_back("not drawn, since they have no area (is their scale 0?): \"" + first +
                           "\"" + (none > 1 ? " and " + std::to_string(none - 1) + " more" : ""));
}

}  // namespace

void addNote(Scene& scene, const std::string& note) {
  if (std::find(scene.notes.begin(), scene.notes.end(), note) == scene.notes.end()) {
    scene.notes.push_back(note);
  }
}

void setMetallicTint(Material& material) {
  const TintShares shares = tintShares(material.metallicFactor, material.dielectricF0);
  material.reflectionTint = shares.plain;
  material.albedoTint = shares.metal;
}

void setReflectance(Material& material, float s, float g) {
  // Without the texture nobody knows where the metal is
  if (material.metallicRoughnessTexture.used()) {
    material.reflectionTint += material.albedoTint * material.baseColor;
    material.albedoTint = 0.0f;
  }
  // With F0 = 0 the mapping gives s back without rounding.
  material.metallicFactor = s;
  material.roughnessFactor = g;
  material.dielectricF0 = Vec3(0.0f);
  material.dielectricF90 = 1.0f;
  material.metallicRoughnessTexture = {};
  material.specularLevel = 0.0f;
  material.roughness = 0.0f;
  material.lobe = LobeModel::Phong;
}

void letDielectricsReflect(Scene& scene) {
  for (Material& m : scene.materials) {
    const bool gltf = m.lobe == LobeModel::Ggx && !m.unlit && m.refraction == 0.0f;
    if (gltf && m.specularLevel <= 0.0f) setLargestReflection(scene, m);
  }
}

void finishScene(Scene& scene) {
  finishMeshes(scene);
  noteMissingTextureCoordinates(scene);
  const std::vector<char> coloured = vertexColoured(scene);
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    finishMaterial(scene, scene.materials[m]);
    finishTint(scene.materials[m], coloured[m] != 0);
  }
  finishObjects(scene);
  scene.fingerprint = fingerprintOf(scene);
  const std::vector<Box3> bounds = boundsOfObjects(scene);
  scene.origin = originOf(bounds);
  warnOfNoExtent(scene, bounds);
  warnOfLostShapes(scene, bounds);
  warnOfLongEdges(scene, bounds);
  for (Light& light : scene.lights) {
    if (light.node == kNone) light.position = Vec3(glm::dvec3(light.position) - scene.origin);
  }
}

}  // namespace catoptric::scene
