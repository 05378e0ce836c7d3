// Normals and tangents of a loaded scene, see finish.h.
#include <cmath>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "scene/finish_steps.h"
#include "scene/tangents.h"

namespace catoptric::scene {
namespace {

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

}  // namespace

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
                       " vertices without a normal got one from the triangles around them");
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
                       " objects have textures but no texture coordinates: one texel colours the "
                       "whole object");
  }
}

}  // namespace catoptric::scene
