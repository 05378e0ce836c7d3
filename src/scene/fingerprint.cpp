// A number that stands for everything in a scene that can change a pixel.
#include <algorithm>
#include <span>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "scene/finish_steps.h"
#include "scene/implicit/surface.h"

namespace catoptric::scene {
namespace {

/// Bytes that one job of the fingerprint takes.
constexpr std::size_t kHashChunk = std::size_t{1} << 18;

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
  void text(const std::string& t) { small_.add(t); }
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
  if (m.tintVaries()) all.value(m.albedoTint);
  if (m.dielectricF0 != Vec3(m.dielectricF0.x)) all.vec(m.dielectricF0);
  if (m.dielectricF90 != 1.0f) all.value(m.dielectricF90);
  for (const TextureSlot* slot :
       {&m.baseColorTexture, &m.emissiveTexture, &m.normalTexture, &m.metallicRoughnessTexture}) {
    all.slot(*slot);
  }
  for (const float x :
       {m.normalScale, m.specularLevel, m.roughness, m.metallicFactor, m.roughnessFactor,
        m.dielectricF0.x, m.alphaCutoff, m.baseAlpha, m.refraction}) {
    all.value(x);
  }
  all.value(m.lobe);
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
  all.value(surface->localFromWorld);
}

void addMeshes(Contents& all, const Scene& scene) {
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
}

void addTextures(Contents& all, const Scene& scene) {
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
}

void addNodes(Contents& all, const Scene& scene) {
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
}

void addObjects(Contents& all, const Scene& scene) {
  all.value(scene.objects.size());
  for (const Object& object : scene.objects) {
    all.text(object.name);  // configs name objects
    all.value(object.mesh);
    all.value(object.node);
    all.value(object.material);
    all.value(object.nodeFromInstance);
    all.value(object.reflector);
    all.value(object.planar);
  }
}

void addLightsAndCameras(Contents& all, const Scene& scene) {
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
    all.value(camera.nearMetres);
  }
}

void addAnimation(Contents& all, const Scene& scene) {
  all.value(scene.animation.size());
  for (const AnimationChannel& channel : scene.animation) {
    all.value(channel.node);
    all.value(channel.target);
    all.value(channel.interpolation);
    all.array(channel.times);
    all.array(channel.values);
  }
}

/// `image` takes the environment's file, which is hashed later.
void addSurroundings(Contents& all, const Scene& scene, std::vector<std::byte>& image) {
  const Environment& environment = scene.environment;
  all.value(environment.type);
  all.vec(environment.color);
  all.vec(environment.horizon);
  all.vec(environment.ground);
  all.value(environment.scale);
  all.value(environment.rotationRad);
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
  if (scene.bake.skyApart) all.value(scene.bake.skyApart);
  all.vec(scene.ambient);
  all.value(scene.origin);
}

}  // namespace

std::uint64_t fingerprintOf(const Scene& scene) {
  Contents all;
  std::vector<std::byte> image;
  addMeshes(all, scene);
  all.value(scene.materials.size());
  for (const Material& material : scene.materials) addMaterial(all, material);
  addTextures(all, scene);
  addNodes(all, scene);
  addObjects(all, scene);
  addLightsAndCameras(all, scene);
  addAnimation(all, scene);
  addSurroundings(all, scene, image);
  if (scene.highlights) all.value(scene.highlights);
  return all.fingerprint();
}

}  // namespace catoptric::scene
