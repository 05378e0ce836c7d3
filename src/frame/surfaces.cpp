#include "frame/surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "frame/harmonics.h"
#include "frame/texture_lookup.h"
#include "scene/implicit/gradient.h"
#include "scene/reflectance.h"

// Points are shaded in steps, each a loop over all of them. Steps that every point needs are plain
// loops over arrays, which the compiler turns into vector code (CMakeLists.txt: no errno, no
// traps). The others take one point at a time. No step changes the order of a point's operations.
namespace catoptric::frame {
namespace {

constexpr std::size_t kMost = SurfaceLanes::kMost;
static_assert(kMost % kWidestVector == 0);

/// Points that memory is asked for before they are shaded. Ours.
constexpr std::size_t kAhead = 8;

/// What a point's material asks for besides the common steps.
enum Step : std::uint32_t {
  kBaseTexture = 1,
  kNormalTexture = 2,
  kMetallicRoughnessTexture = 4,
  kEmissiveTexture = 8,
  kUnlit = 16,
  kImplicit = 32
};

/// A texture slot of an object, ready to be sampled.
struct Slot {
  const scene::TextureSlot* slot = nullptr;
  const scene::Texture* texture = nullptr;
  float texelsPerMetre = 0.0f;
};

/// What shading needs of an object.
struct Look {
  const ObjectRange* range = nullptr;
  const scene::Material* material = nullptr;
  std::uint32_t steps = 0;
  Slot base, normal, metallicRoughness, emissive;
};

using Lane = std::array<float, kMost>;
using Vectors = Vec3Lanes<kMost>;

/// What the steps hand on to each other. A thread reuses it: values of surplus lanes are old.
struct Work {
  std::array<const std::uint32_t*, kMost> triangles{};
  std::array<std::uint16_t, kMost> lookOf{};
  std::array<Look, kMost> looks;  ///< of neighbours on the same object once
  std::array<Vec4, kMost> uv{};   ///< of both sets
  std::array<Vec4, kMost> tangent{};
  std::array<Vec4, kMost> metallicRoughness{};
  std::array<TexturePlace, kMost> places;
  Vectors smooth, geometric;  ///< N, and normal of the triangle
  Vectors normal;             ///< n
  Vectors edge1, edge2;
  Vectors albedo, emissive, vertexColor, bake, irradiance;
  alignas(64) Lane visibility{};
  alignas(64) Lane facing{};  ///< the root in the formula of lod
  alignas(64) Lane back{};    ///< 1 or 0
  std::uint32_t steps = 0;    ///< of any point

  const Look& look(std::size_t i) const { return looks[lookOf[i]]; }
};

Slot slotOf(const scene::Scene& scene, const ObjectRange& range, const scene::TextureSlot& slot) {
  if (!slot.used()) return {};
  return {&slot, &scene.textures[slot.texture], range.uvPerMetre * textureScale(scene, slot)};
}

Look lookOf(const scene::Scene& scene, const Geometry& geometry, int object) {
  Look look;
  look.range = &geometry.objects[object];
  look.material = &scene.materials[scene.objects[object].material];
  const scene::Material& m = *look.material;
  look.base = slotOf(scene, *look.range, m.baseColorTexture);
  look.normal = slotOf(scene, *look.range, m.normalTexture);
  look.metallicRoughness = slotOf(scene, *look.range, m.metallicRoughnessTexture);
  look.emissive = slotOf(scene, *look.range, m.emissiveTexture);
  look.steps = (m.baseColorTexture.used() ? kBaseTexture : 0u) |
               (m.normalTexture.used() ? kNormalTexture : 0u) |
               (m.metallicRoughnessTexture.used() ? kMetallicRoughnessTexture : 0u) |
               (m.emissiveTexture.used() ? kEmissiveTexture : 0u) | (m.unlit ? kUnlit : 0u) |
               (look.range->surface >= 0 ? kImplicit : 0u);
  return look;
}

CATOPTRIC_INLINE void findLooks(const scene::Scene& scene, const Geometry& geometry,
                                const SurfaceLanes& lanes, Work& work) {
  int object = -1;
  std::uint16_t looks = 0;
  work.steps = 0;
  for (std::size_t i = 0; i < lanes.count; ++i) {
    if (lanes.object[i] != object) {
      object = lanes.object[i];
      work.looks[looks++] = lookOf(scene, geometry, object);
      work.steps |= work.looks[looks - 1].steps;
    }
    work.lookOf[i] = static_cast<std::uint16_t>(looks - 1);
    const Look& look = work.looks[looks - 1];
    work.triangles[i] =
        &geometry.indices[look.range->firstIndex + std::size_t{3} * lanes.primitive[i]];
    __builtin_prefetch(work.triangles[i]);
    work.albedo.set(i, look.material->baseColor);
    work.emissive.set(i, look.material->emissive);
  }
}

static_assert(offsetof(VertexAttributes, tangent) == 12 && offsetof(VertexAttributes, uv0) == 28 &&
              offsetof(VertexAttributes, uv1) == 36 && offsetof(VertexAttributes, color) == 44 &&
              offsetof(VertexAttributes, bake) == 56 && sizeof(VertexAttributes) == 72);

/// Four floats of a triangle's attributes, from this one on, interpolated.
CATOPTRIC_INLINE Floats4 interpolated(const std::array<const float*, 3>& vertices, int first,
                                      float u, float v) {
  return (1.0f - u - v) * load<Floats4>(vertices[0] + first) +
         u * load<Floats4>(vertices[1] + first) + v * load<Floats4>(vertices[2] + first);
}

CATOPTRIC_INLINE void storeRows(std::array<Floats4, 4>& rows, Vectors& to, std::size_t at) {
  transpose(rows[0], rows[1], rows[2], rows[3]);
  store(rows[0], &to.x[at]);
  store(rows[1], &to.y[at]);
  store(rows[2], &to.z[at]);
}

/// Interpolates the attributes, four points at a time.
CATOPTRIC_INLINE void gather(const Geometry& geometry, const SurfaceLanes& lanes, Work& work) {
  for (std::size_t i = 0; i < std::min(kAhead, lanes.count); ++i)
    prefetchTriangle(geometry, work.triangles[i]);
  for (std::size_t first = 0; first < lanes.count; first += 4) {
    std::array<Floats4, 4> normal{}, color{}, bake{}, edge1{}, edge2{};
    for (std::size_t k = 0; k < std::min<std::size_t>(4, lanes.count - first); ++k) {
      const std::size_t i = first + k;
      if (i + kAhead < lanes.count) prefetchTriangle(geometry, work.triangles[i + kAhead]);
      const std::uint32_t* const t = work.triangles[i];
      const std::array<const float*, 3> vertices{&geometry.attributes[t[0]].normal.x,
                                                 &geometry.attributes[t[1]].normal.x,
                                                 &geometry.attributes[t[2]].normal.x};
      const float u = lanes.u[i];
      const float v = lanes.v[i];
      normal[k] = interpolated(vertices, 0, u, v);
      store(interpolated(vertices, 7, u, v), &work.uv[i]);
      color[k] = interpolated(vertices, 11, u, v);
      bake[k] = interpolated(vertices, 14, u, v);
      if ((work.steps & kNormalTexture) != 0)
        store(interpolated(vertices, 3, u, v), &work.tangent[i]);
      // Geometry::positions ends with an unused one
      const auto p0 = load<Floats4>(&geometry.positions[t[0]]);
      edge1[k] = load<Floats4>(&geometry.positions[t[1]]) - p0;
      edge2[k] = load<Floats4>(&geometry.positions[t[2]]) - p0;
    }
    storeRows(normal, work.smooth, first);
    storeRows(color, work.vertexColor, first);
    storeRows(bake, work.bake, first);
    store(bake[3], &work.visibility[first]);
    storeRows(edge1, work.edge1, first);
    storeRows(edge2, work.edge2, first);
  }
}

/// N and the triangle's normal, as normalizedOr() gives them.
CATOPTRIC_INLINE void makeNormals(std::size_t count, Work& work) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float x = work.smooth.x[i], y = work.smooth.y[i], z = work.smooth.z[i];
    const float length = std::sqrt(x * x + y * y + z * z);
    const bool usable = length > 0.0f && length <= kLargest;
    const float sx = usable ? x / length : 0.0f;
    const float sy = usable ? y / length : 1.0f;
    const float sz = usable ? z / length : 0.0f;
    const float ax = work.edge1.x[i], ay = work.edge1.y[i], az = work.edge1.z[i];
    const float bx = work.edge2.x[i], by = work.edge2.y[i], bz = work.edge2.z[i];
    const float cx = ay * bz - by * az;
    const float cy = az * bx - bz * ax;
    const float cz = ax * by - bx * ay;
    const float across = std::sqrt(cx * cx + cy * cy + cz * cz);
    const bool faces = across > 0.0f && across <= kLargest;
    work.geometric.x[i] = faces ? cx / across : sx;
    work.geometric.y[i] = faces ? cy / across : sy;
    work.geometric.z[i] = faces ? cz / across : sz;
    work.smooth.x[i] = sx;
    work.smooth.y[i] = sy;
    work.smooth.z[i] = sz;
  }
}

/// Implicit surfaces have the normal of the gradient, where there is one.
void makeExactNormals(const Geometry& geometry, const SurfaceLanes& lanes, Work& work) {
  for (std::size_t i = 0; i < lanes.count; ++i) {
    const int surface = work.look(i).range->surface;
    if (surface < 0) continue;
    const auto exact = implicit::normalAt(geometry.surfaces[surface].surface, lanes.position.at(i));
    if (!exact) continue;
    work.smooth.set(i, Vec3(*exact));
    work.geometric.set(i, Vec3(*exact));
  }
}

/// The visible side: both normals are turned to it; facing.
CATOPTRIC_INLINE void turnNormals(std::size_t count, const SurfaceLanes& lanes, Work& work) {
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const float dx = lanes.direction.x[i], dy = lanes.direction.y[i], dz = lanes.direction.z[i];
    const float gx = work.geometric.x[i], gy = work.geometric.y[i], gz = work.geometric.z[i];
    const float x = work.smooth.x[i], y = work.smooth.y[i], z = work.smooth.z[i];
    const float back = gx * dx + gy * dy + gz * dz > 0.0f ? 1.0f : 0.0f;
    const float cosine = std::abs(x * dx + y * dy + z * dz);
    work.facing[i] = std::sqrt(cosine < 0.05f ? 0.05f : cosine);
    work.back[i] = back;
    work.geometric.x[i] = back > 0.0f ? -gx : gx;
    work.geometric.y[i] = back > 0.0f ? -gy : gy;
    work.geometric.z[i] = back > 0.0f ? -gz : gz;
    work.normal.x[i] = back > 0.0f ? -x : x;
    work.normal.y[i] = back > 0.0f ? -y : y;
    work.normal.z[i] = back > 0.0f ? -z : z;
  }
}

CATOPTRIC_INLINE Vec2 slotUv(const scene::TextureSlot& slot, const Vec4& uv) {
  const Vec2 at = slot.uvSet == 1 ? Vec2(uv.z, uv.w) : Vec2(uv);
  return slot.transform * Vec3(at, 1.0f);
}

CATOPTRIC_INLINE float lodOf(const Slot& slot, const SurfaceLanes& lanes, const Work& work,
                             std::size_t i) {
  const float footprint = slot.texelsPerMetre * lanes.coneWidth[i] / work.facing[i];
  return std::log2(std::max(1e-8f, footprint));
}

/// A normal map's texel in the frame of the interpolated normal and tangent, on the visible side.
Vec3 mappedNormal(const Work& work, std::size_t i, const Vec3& texel) {
  const scene::Material& material = *work.look(i).material;
  const Vec3 smooth = work.smooth.at(i);
  const Vec4& tangent = work.tangent[i];
  const Vec3 t = normalizedOr(Vec3(tangent), Vec3(1.0f, 0.0f, 0.0f));
  const Vec3 b = glm::cross(smooth, t) * tangent.w;
  Vec3 m = 2.0f * texel - Vec3(1.0f);
  m.x *= material.normalScale;
  m.y *= material.normalScale;
  const Vec3 n = normalizedOr(m.x * t + m.y * b + m.z * smooth, smooth);
  return work.back[i] > 0.0f ? -n : n;
}

/// Calls use(point, texel) for the points whose material has this texture. All texels are found
/// first, so that their loads overlap.
template <class Use>
CATOPTRIC_INLINE void readTexture(Step step, Slot Look::*slot, const SurfaceLanes& lanes,
                                  Work& work, const Use& use) {
  if ((work.steps & step) == 0) return;
  const float* const linear = linearOfSrgb8().data();
  for (std::size_t i = 0; i < lanes.count; ++i) {
    const Look& look = work.look(i);
    if ((look.steps & step) == 0) continue;
    const Slot& of = look.*slot;
    placeLookUp(*of.texture, slotUv(*of.slot, work.uv[i]), lodOf(of, lanes, work, i),
                work.places[i]);
    prefetch(work.places[i]);
  }
  for (std::size_t i = 0; i < lanes.count; ++i) {
    const Look& look = work.look(i);
    if ((look.steps & step) == 0) continue;
    use(i, lookUp(*(look.*slot).texture, work.places[i], linear));
  }
}

/// The textures of the material: albedo and emissive without vertex colours, normals of bumps,
/// metallic and roughness.
CATOPTRIC_INLINE void readTextures(const SurfaceLanes& lanes, bool reflections, Work& work) {
  readTexture(kBaseTexture, &Look::base, lanes, work, [&](std::size_t i, const Floats4& t) {
    work.albedo.set(i, work.albedo.at(i) * Vec3(t[0], t[1], t[2]));
  });
  readTexture(kNormalTexture, &Look::normal, lanes, work, [&](std::size_t i, const Floats4& t) {
    work.normal.set(i, mappedNormal(work, i, Vec3(t[0], t[1], t[2])));
  });
  readTexture(kEmissiveTexture, &Look::emissive, lanes, work, [&](std::size_t i, const Floats4& t) {
    work.emissive.set(i, work.emissive.at(i) * Vec3(t[0], t[1], t[2]));
  });
  if (!reflections) return;
  readTexture(kMetallicRoughnessTexture, &Look::metallicRoughness, lanes, work,
              [&](std::size_t i, const Floats4& t) { store(t, &work.metallicRoughness[i]); });
}

/// Albedo, and the irradiance of what is baked and of the sky.
CATOPTRIC_INLINE void makeIrradiance(std::size_t count, const Lighting& lighting, Work& work) {
  const std::array<Vec3, 9> c = lighting.environment->irradianceSh();
  const Vec3 ambient = kPi * lighting.ambient;
  const auto ofSky = [&](const std::array<float, 9>& basis, int channel, float more)
      __attribute__((always_inline)) {
    float sum = 0.0f;
    for (std::size_t k = 0; k < 9; ++k) sum += basis[k] * c[k][channel];
    return (0.0f > sum ? 0.0f : sum) + more;
  };
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<float, 9> basis =
        sphericalHarmonics<float>(work.normal.x[i], work.normal.y[i], work.normal.z[i]);
    const float visibility = work.visibility[i];
    const bool open = visibility > 0.0f;
    const float x = work.bake.x[i], y = work.bake.y[i], z = work.bake.z[i];
    work.irradiance.x[i] = open ? x + visibility * ofSky(basis, 0, ambient.x) : x;
    work.irradiance.y[i] = open ? y + visibility * ofSky(basis, 1, ambient.y) : y;
    work.irradiance.z[i] = open ? z + visibility * ofSky(basis, 2, ambient.z) : z;
    work.albedo.x[i] *= work.vertexColor.x[i];
    work.albedo.y[i] *= work.vertexColor.y[i];
    work.albedo.z[i] *= work.vertexColor.z[i];
  }
}

void addLights(const Lighting& lighting, const SurfaceLanes& lanes, Work& work) {
  for (const WorldLight& light : lighting.lights) {
    for (std::size_t i = 0; i < lanes.count; ++i)
      work.irradiance.set(i, work.irradiance.at(i) +
                                 lightIrradiance(light, lanes.position.at(i), work.normal.at(i)));
  }
}

CATOPTRIC_INLINE void makeDiffuse(std::size_t count, const Work& work, SurfaceLanes& lanes) {
  constexpr float kShare = 1.0f / kPi;
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < count; ++i) {
    lanes.diffuse.x[i] = work.albedo.x[i] * kShare * work.irradiance.x[i] + work.emissive.x[i];
    lanes.diffuse.y[i] = work.albedo.y[i] * kShare * work.irradiance.y[i] + work.emissive.y[i];
    lanes.diffuse.z[i] = work.albedo.z[i] * kShare * work.irradiance.z[i] + work.emissive.z[i];
  }
}

/// A texel of the footprint of level `lod`, from a finer level.
Vec4 scatteredTexel(const scene::Texture& texture, const Vec2& uv, float lod, const Vec2& scatter) {
  const bool levelled = !texture.nearest && !texture.levels.empty();
  const float last = levelled ? static_cast<float>(texture.levels.size() - 1) : 0.0f;
  const float level = std::clamp(lod, 0.0f, last);
  if (!(level > 0.0f)) return sampleTexture(texture, uv, 0.0f);
  const Vec2 size(texture.levels[0].width, texture.levels[0].height);
  const Vec2 offset = (scatter - 0.5f) * (std::exp2(level) - 1.0f) / size;
  return sampleTexture(texture, uv + offset, std::max(level - kFinerLevels, 0.0f));
}

/// s, the lobe, the tint and F90. `texel`: of the metallic-roughness texture.
void setReflection(const scene::Material& material, const Vec4& texel, const Vec3& albedo,
                   SurfacePoint& point) {
  point.specularLevel = material.specularLevel;
  float roughness = material.roughness;
  float metallic = material.metallicFactor;
  if (material.metallicRoughnessTexture.used()) {
    roughness = material.roughnessFactor * texel.g;
    metallic *= texel.b;
    const float s = scene::specularLevel(metallic, material.dielectricF0);
    const bool phong = material.lobe == scene::LobeModel::Phong;
    point.specularLevel = phong && s < scene::kReflectiveThreshold ? 0.0f : s;
  }
  point.lobe = scene::Lobe::of(material.lobe, roughness);
  point.tint = reflectionTint(material, metallic, albedo);
  point.f90 = scene::rimLevel(metallic, material.dielectricF90);
}

/// A point with all that a reflection there needs.
void makePoint(const scene::Scene& scene, const Lighting& lighting, const SurfaceLanes& lanes,
               const Work& work, std::size_t i, SurfacePoint& point) {
  const Look& look = work.look(i);
  const scene::Material& material = *look.material;
  const Vec3 direction = lanes.direction.at(i);
  point.object = lanes.object[i] + 1;
  point.position = lanes.position.at(i);
  point.diffuse = lanes.diffuse.at(i);
  const Vec3 geometric = work.geometric.at(i);
  Vec3 normal = work.normal.at(i);
  point.highlight = Vec3(0.0f);
  point.bent = false;
  setReflection(material, work.metallicRoughness[i], work.albedo.at(i), point);
  const bool reflects = point.specularLevel > 0.0f;
  if (reflects && (look.steps & kNormalTexture) != 0) {
    const Vec4 texel = scatteredTexel(*look.normal.texture, slotUv(*look.normal.slot, work.uv[i]),
                                      lodOf(look.normal, lanes, work, i), lanes.scatter[i]);
    normal = mappedNormal(work, i, Vec3(texel));
  }
  const bool bends = reflects && bendsNormals(scene, *look.range, lanes.object[i]);
  if (bends) point.bent = aboveSurface(geometric, direction, normal);
  point.geometricNormal = geometric;
  point.normal = normal;
  point.lobeHorizon = bends && !point.lobe.mirror() ? geometric : normal;
  const bool shines =
      lighting.highlights && material.refraction == 0.0f && reflects && !point.lobe.mirror();
  if (shines)
    point.highlight = lightHighlights(lighting.lights, lanes.position.at(i), normal,
                                      point.lobeHorizon, direction, point.lobe);
}

CATOPTRIC_INLINE void shadeBody(const scene::Scene& scene, const Geometry& geometry,
                                const Lighting& lighting, SurfaceLanes& lanes, bool reflections,
                                Work& work) {
  const std::size_t count = wholeVectors(lanes.count);
  findLooks(scene, geometry, lanes, work);
  gather(geometry, lanes, work);
  makeNormals(count, work);
  if ((work.steps & kImplicit) != 0) makeExactNormals(geometry, lanes, work);
  turnNormals(count, lanes, work);
  readTextures(lanes, reflections, work);
  makeIrradiance(count, lighting, work);
  addLights(lighting, lanes, work);
  makeDiffuse(count, work, lanes);
  for (std::size_t i = 0; (work.steps & kUnlit) != 0 && i < lanes.count; ++i)
    if (work.look(i).material->unlit) lanes.diffuse.set(i, work.albedo.at(i));
}

}  // namespace

void shadeSurfaces(const scene::Scene& scene, const Geometry& geometry, const Lighting& lighting,
                   SurfaceLanes& lanes, SurfacePoint* points) {
  static thread_local Work work;
  atVectorLevel<shadeBody>(scene, geometry, lighting, lanes, points != nullptr, work);
  for (std::size_t i = 0; points != nullptr && i < lanes.count; ++i)
    makePoint(scene, lighting, lanes, work, i, points[i]);
}

SurfacePoint shadeSurface(const scene::Scene& scene, const Geometry& geometry,
                          const Lighting& lighting, int object, std::uint32_t primitive, float u,
                          float v, const Vec3& position, const Vec3& direction, float coneWidth,
                          const Vec2& scatter) {
  static thread_local SurfaceLanes lanes;
  lanes.count = 0;
  lanes.scatter[0] = scatter;
  lanes.add(object, primitive, u, v, position, direction, coneWidth);
  SurfacePoint point;
  shadeSurfaces(scene, geometry, lighting, lanes, &point);
  return point;
}

bool isCutOut(const scene::Scene& scene, const Geometry& geometry, int object,
              std::uint32_t primitive, float u, float v) {
  const scene::Material& material = scene.materials[scene.objects[object].material];
  if (material.alphaMode != scene::AlphaMode::Mask) return false;
  const scene::TextureSlot& slot = material.baseColorTexture;
  float alpha = material.baseAlpha;
  if (slot.used()) {
    const std::uint32_t* const t =
        &geometry.indices[geometry.objects[object].firstIndex + 3 * primitive];
    const auto uvOf = [&](int corner) {
      const VertexAttributes& vertex = geometry.attributes[t[corner]];
      return slot.uvSet == 1 ? vertex.uv1 : vertex.uv0;
    };
    const Vec2 uv = (1.0f - u - v) * uvOf(0) + u * uvOf(1) + v * uvOf(2);
    alpha *= sampleTexture(scene.textures[slot.texture], slot.transform * Vec3(uv, 1.0f), 0.0f).a;
  }
  return alpha < material.alphaCutoff;
}

}  // namespace catoptric::frame
