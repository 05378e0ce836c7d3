// What both loaders leave to one place, see finishScene in loader.h.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>
#include <string>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "scene/animate.h"
#include "scene/implicit/surface.h"
#include "scene/loader.h"
#include "scene/reflectance.h"
#include "scene/tangents.h"

namespace catoptric::scene {
namespace {

/// A vertex farther from the plane than this share of the mesh's diameter, or a normal farther from
/// the plane's than this cosine (0.8 degrees: normals in bytes are that coarse), makes a mesh
/// curved. Ours.
constexpr float kPlanarDistance = 1e-5f;
constexpr float kPlanarCosine = 0.9999f;

/// Bytes that one job of the fingerprint takes.
constexpr std::size_t kHashChunk = std::size_t{1} << 18;

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

void addNote(Scene& scene, const std::string& note) {
  if (std::find(scene.notes.begin(), scene.notes.end(), note) == scene.notes.end()) {
    scene.notes.push_back(note);
  }
}

// ---- Normals and tangents ----

/// Makes normals unit; those without length come from the triangles around. Returns their number.
std::size_t finishNormals(Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  mesh.normals.resize(count, Vec3(0.0f));
  std::vector<Vec3> fromTriangles;
  std::size_t replaced = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3& n = mesh.normals[i];
    const float squared = glm::dot(n, n);
    // What is unit up to rounding stays as it is.
    if (std::abs(squared - 1.0f) < 1e-6f) continue;
    if (squared > 1e-12f && std::isfinite(squared)) {
      n /= std::sqrt(squared);
      continue;
    }
    if (fromTriangles.empty()) {
      // Sums of cross products weigh triangles by area; in double they do not underflow.
      std::vector<glm::dvec3> sums(count, glm::dvec3(0.0));
      for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
        const std::uint32_t* v = mesh.indices.data() + t;
        const glm::dvec3 a(mesh.positions[v[0]]);
        const glm::dvec3 area =
            glm::cross(glm::dvec3(mesh.positions[v[1]]) - a, glm::dvec3(mesh.positions[v[2]]) - a);
        for (int k = 0; k < 3; ++k) sums[v[k]] += area;
      }
      fromTriangles.resize(count);
      for (std::size_t v = 0; v < count; ++v) {
        const double length = glm::length(sums[v]);
        fromTriangles[v] =
            length > 0.0 ? glm::normalize(Vec3(sums[v] / length)) : Vec3(0.0f, 1.0f, 0.0f);
      }
    }
    n = fromTriangles[i];
    ++replaced;
  }
  return replaced;
}

/// Makes given tangents unit and perpendicular to the normals. Returns the number made up.
std::size_t finishTangents(Mesh& mesh) {
  std::size_t madeUp = 0;
  for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
    const Vec3& n = mesh.normals[i];
    const Vec3 given(mesh.tangents[i]);
    const Vec3 t = given - n * glm::dot(n, given);
    const float squared = glm::dot(t, t);
    const float w = mesh.tangents[i].w < 0.0f ? -1.0f : 1.0f;
    if (squared > 1e-8f && std::isfinite(squared)) {
      if (std::abs(squared - 1.0f) > 1e-6f || t != given) {
        mesh.tangents[i] = Vec4(t / std::sqrt(squared), w);
      }
    } else {
      mesh.tangents[i] = Vec4(anyPerpendicular(n), w);
      ++madeUp;
    }
  }
  return madeUp;
}

void finishMeshes(Scene& scene) {
  // The first object's material says how a mesh's tangents lie.
  std::vector<int> materialWithNormals(scene.meshes.size(), kNone);
  for (const Object& object : scene.objects) {
    const bool needed = scene.materials[index(object.material)].normalTexture.used();
    int& material = materialWithNormals[index(object.mesh)];
    if (needed && material == kNone) material = object.material;
  }
  struct Counts {
    std::size_t normals = 0;
    std::size_t tangents = 0;
  };
  std::vector<Counts> counts(scene.meshes.size());
  parallelFor(scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      Mesh& mesh = scene.meshes[m];
      counts[m].normals = finishNormals(mesh);
      if (materialWithNormals[m] == kNone) {
        // No memory for what nobody reads.
        mesh.tangents = {};
        for (MorphTarget& target : mesh.morphTargets) target.tangents = {};
      } else if (mesh.tangents.size() != mesh.positions.size()) {
        counts[m].tangents =
            makeTangents(mesh, scene.materials[index(materialWithNormals[m])].normalTexture);
      } else {
        counts[m].tangents = finishTangents(mesh);
      }
    }
  });
  Counts total;
  for (const Counts& c : counts) {
    total.normals += c.normals;
    total.tangents += c.tangents;
  }
  if (total.normals > 0) {
    addNote(scene, std::to_string(total.normals) +
                       " vertices without a normal got that of the triangles around them");
  }
  if (total.tangents > 0) {
    addNote(scene, std::to_string(total.tangents) +
                       " vertices of normal-mapped surfaces got an arbitrary tangent (no usable "
                       "texture coordinates)");
  }
}

void noteMissingTextureCoordinates(Scene& scene) {
  std::size_t count = 0;
  for (const Object& object : scene.objects) {
    const Material& m = scene.materials[index(object.material)];
    const Mesh& mesh = scene.meshes[index(object.mesh)];
    for (const TextureSlot* slot :
         {&m.baseColorTexture, &m.emissiveTexture, &m.normalTexture, &m.metallicRoughnessTexture}) {
      if (slot->used() && mesh.uv[index(slot->uvSet)].empty()) {
        ++count;
        break;
      }
    }
  }
  if (count > 0) {
    addNote(scene, std::to_string(count) +
                       " objects have textures but no texture coordinates: one texel covers them");
  }
}

// ---- Reflection ----

/// Largest value of one channel over a texture's image, 0..1.
float largestTexel(const Texture& texture, std::size_t channel) {
  if (texture.levels.empty()) return 1.0f;
  std::uint8_t largest = 0;
  const std::vector<std::uint8_t>& rgba = texture.levels.front().rgba;
  for (std::size_t i = channel; i < rgba.size(); i += 4) largest = std::max(largest, rgba[i]);
  return static_cast<float>(largest) / 255.0f;
}

/// s and g by scene/reflectance.h, unless a loader has set them already. With a texture the
/// largest s and g of any texel stand for the material: an object whose texture makes any part
/// reflect is a reflector.
void finishMaterial(const Scene& scene, Material& m) {
  if (m.unlit) {
    m.specularLevel = 0.0f;
    m.glossiness = 0.0f;
    return;
  }
  if (m.specularLevel <= 0.0f) {
    float metallic = m.metallicFactor;
    float roughness = m.roughnessFactor;
    if (m.metallicRoughnessTexture.used()) {
      const Texture& texture = scene.textures[index(m.metallicRoughnessTexture.texture)];
      metallic *= largestTexel(texture, 2);
      roughness *= largestTexel(texture, 1);
    }
    m.specularLevel = specularLevel(metallic, m.dielectricF0);
    m.glossiness = roughness;
  }
  m.specularLevel = std::min(m.specularLevel, 1.0f);
  m.glossiness = std::clamp(m.glossiness, 0.0f, 1.0f);
  if (m.specularLevel < kReflectiveThreshold) {
    m.specularLevel = 0.0f;
    m.glossiness = 0.0f;
  }
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

// ---- Fingerprint ----

/// Collects small values at once, and arrays to be hashed in parallel afterwards.
class Contents {
 public:
  template <class T>
  void value(const T& v) {
    small_.addValue(v);
  }
  void vec(const Vec3& v) {
    for (int c = 0; c < 3; ++c) value(v[c]);
  }
  template <class T>
  void array(const std::vector<T>& values) {
    static_assert(std::has_unique_object_representations_v<T> ||
                  sizeof(T) % sizeof(float) == 0);  // no padding
    value(values.size());
    const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
    for (std::size_t at = 0; at < bytes.size(); at += kHashChunk) {
      chunks_.push_back(bytes.subspan(at, std::min(kHashChunk, bytes.size() - at)));
    }
  }
  void slot(const TextureSlot& s) {
    value(s.texture);
    value(s.uvSet);
    for (int column = 0; column < 3; ++column) {
      value(s.transform[column].x);
      value(s.transform[column].y);
    }
  }

  std::uint64_t fingerprint() {
    std::vector<std::uint64_t> hashes(chunks_.size());
    parallelFor(chunks_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Fingerprint f;
        f.add(chunks_[i]);
        hashes[i] = f.value();
      }
    });
    small_.addArray(std::span<const std::uint64_t>(hashes));
    return small_.value();
  }

 private:
  Fingerprint small_;
  std::vector<std::span<const std::byte>> chunks_;
};

void addMaterial(Contents& all, const Material& m) {
  all.vec(m.baseColor);
  all.vec(m.emissive);
  all.vec(m.reflectionTint);
  for (const TextureSlot* slot :
       {&m.baseColorTexture, &m.emissiveTexture, &m.normalTexture, &m.metallicRoughnessTexture}) {
    all.slot(*slot);
  }
  for (const float x :
       {m.normalScale, m.specularLevel, m.glossiness, m.metallicFactor, m.roughnessFactor,
        m.dielectricF0, m.alphaCutoff, m.baseAlpha, m.refraction}) {
    all.value(x);
  }
  all.value(m.alphaMode);
  all.value(m.unlit);
}

void addSurface(Contents& all, const implicit::Surface* surface) {
  all.value(surface != nullptr);
  if (surface == nullptr) return;
  for (const implicit::Operation& operation : surface->tape) {
    all.value(operation.code);
    all.value(operation.a);
    all.value(operation.b);
    all.value(operation.constant);
  }
  for (int a = 0; a < 3; ++a) {
    all.value(surface->domain.min[a]);
    all.value(surface->domain.max[a]);
  }
}

/// Everything that can change a pixel; no names, no notes.
std::uint64_t fingerprintOf(const Scene& scene) {
  Contents all;
  all.value(scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) {
    all.array(mesh.positions);
    all.array(mesh.normals);
    all.array(mesh.tangents);
    all.array(mesh.uv[0]);
    all.array(mesh.uv[1]);
    all.array(mesh.colors);
    all.array(mesh.joints);
    all.array(mesh.weights);
    all.array(mesh.indices);
    addSurface(all, mesh.surface.get());
    all.value(mesh.morphTargets.size());
    for (const MorphTarget& target : mesh.morphTargets) {
      all.array(target.positions);
      all.array(target.normals);
      all.array(target.tangents);
    }
  }
  all.value(scene.materials.size());
  for (const Material& material : scene.materials) addMaterial(all, material);
  all.value(scene.textures.size());
  for (const Texture& texture : scene.textures) {
    all.value(texture.srgb);
    all.value(texture.nearest);
    all.value(texture.wrapS);
    all.value(texture.wrapT);
    all.value(texture.levels.size());
    if (texture.levels.empty()) continue;
    // The other levels follow from the first.
    all.value(texture.levels.front().width);
    all.value(texture.levels.front().height);
    all.array(texture.levels.front().rgba);
  }
  all.value(scene.nodes.size());
  for (const Node& node : scene.nodes) {
    all.value(node.parent);
    all.value(node.hasMatrix);
    all.value(node.matrix);
    all.vec(node.translation);
    all.value(node.rotation);
    all.vec(node.scale);
    all.value(node.skin);
    all.array(node.morphWeights);
  }
  all.value(scene.skins.size());
  for (const Skin& skin : scene.skins) {
    all.array(skin.joints);
    all.array(skin.inverseBind);
  }
  all.value(scene.objects.size());
  for (const Object& object : scene.objects) {
    all.value(object.mesh);
    all.value(object.node);
    all.value(object.material);
    all.value(object.nodeFromInstance);
    all.value(object.reflector);
    all.value(object.planar);
  }
  all.value(scene.lights.size());
  for (const Light& light : scene.lights) {
    all.value(light.type);
    all.vec(light.intensity);
    for (const float x : {light.range, light.innerConeRad, light.outerConeRad, light.radius}) {
      all.value(x);
    }
    all.value(light.baked);
    all.value(light.node);
    all.vec(light.position);
    all.vec(light.direction);
  }
  all.value(scene.cameras.size());
  for (const CameraDefinition& camera : scene.cameras) {
    all.value(camera.node);
    all.value(camera.verticalFovRad);
  }
  all.value(scene.animation.size());
  for (const AnimationChannel& channel : scene.animation) {
    all.value(channel.node);
    all.value(channel.target);
    all.value(channel.interpolation);
    all.array(channel.times);
    all.array(channel.values);
  }
  const Environment& environment = scene.environment;
  all.value(environment.type);
  all.vec(environment.color);
  all.vec(environment.horizon);
  all.vec(environment.ground);
  all.value(environment.scale);
  all.value(environment.rotationRad);
  std::vector<std::byte> image;
  if (environment.type == EnvironmentType::File) {
    // A file that cannot be read is reported by whoever needs its pixels.
    try {
      image = readFile(environment.file);
    } catch (const Error&) {
      image.clear();
    }
    all.array(image);
  }
  all.value(scene.bake.mode);
  all.value(scene.bake.rays);
  all.value(scene.bake.bounces);
  all.value(scene.bake.ambientOcclusionDistance);
  all.vec(scene.ambient);
  return all.fingerprint();
}

}  // namespace

void setReflectance(Material& material, float s, float g) {
  // With F0 = 0 the mapping gives s back without rounding.
  material.metallicFactor = s;
  material.roughnessFactor = g;
  material.dielectricF0 = 0.0f;
  material.metallicRoughnessTexture = {};
  material.specularLevel = 0.0f;
  material.glossiness = 0.0f;
}

namespace {

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
    std::ostringstream text;
    text.precision(2);
    text << "\"" << scene.objects[o].name << "\" is " << size << " m large and lies " << away
         << " m from the scene's origin, where its corners are rounded to about " << spacing
         << " m";
    what = text.str();
  }
  if (lost == 0) return;
  scene.warnings.push_back(
      what + (lost > 1 ? " (the worst of " + std::to_string(lost) + " such objects)" : "") +
      "; floats hold the shape of nothing so small so far away: leave it out, move it nearer to "
      "the rest, or put what is looked at around 0");
}

}  // namespace

void finishScene(Scene& scene) {
  finishMeshes(scene);
  noteMissingTextureCoordinates(scene);
  for (Material& material : scene.materials) finishMaterial(scene, material);
  finishObjects(scene);
  scene.fingerprint = fingerprintOf(scene);
  const std::vector<Box3> bounds = boundsOfObjects(scene);
  scene.origin = originOf(bounds);
  warnOfLostShapes(scene, bounds);
  for (Light& light : scene.lights) {
    if (light.node == kNone) light.position = Vec3(glm::dvec3(light.position) - scene.origin);
  }
}

}  // namespace catoptric::scene
