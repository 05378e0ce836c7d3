#include "raster/scene_gpu/scene_gpu.h"

#include <algorithm>
#include <utility>

#include "core/srgb.h"
#include "raster/constants.h"
#include "raster/scene_gpu/level_cache.h"

namespace catoptric::raster {
namespace {

float largest(const Vec3& v) {
  return std::max({v.x, v.y, v.z});
}

/// Linear mean of a texture: its last mip level.
Vec3 meanColor(const scene::Texture& texture) {
  if (texture.levels.empty() || texture.levels.back().rgba.size() < 3) return Vec3(1.0f);
  const std::vector<std::uint8_t>& last = texture.levels.back().rgba;
  const auto linear = [&](std::size_t i) {
    return texture.srgb ? linearOfSrgb8()[last[i]] : static_cast<float>(last[i]) / 255.0f;
  };
  return {linear(0), linear(1), linear(2)};
}

Brightest brightestOf(const scene::Scene& scene, const frame::Geometry& geometry) {
  Brightest brightest;
  float color = 0.0f;
  for (const frame::VertexAttributes& vertex : geometry.attributes) {
    brightest.irradiance = std::max(brightest.irradiance, largest(Vec3(vertex.bake)));
    color = std::max(color, largest(vertex.color));
  }
  for (const scene::Material& material : scene.materials) {
    brightest.albedo = std::max(brightest.albedo, color * largest(material.baseColor));
    brightest.emission = std::max(brightest.emission, largest(material.emissive));
  }
  return brightest;
}

}  // namespace

/// Variants read only the attributes that they use.
void describeVertices(gl::VertexArray& array, const gl::Buffer& positions,
                      const gl::Buffer& attributes, std::uint32_t firstVertex) {
  using Attributes = frame::VertexAttributes;
  array.setAttribute(shared::kPositionAttribute, positions, 3, GL_FLOAT, firstVertex * sizeof(Vec3),
                     sizeof(Vec3));
  const auto attribute = [&](GLuint location, int components, std::size_t offset) {
    array.setAttribute(location, attributes, components, GL_FLOAT,
                       firstVertex * sizeof(Attributes) + offset, sizeof(Attributes));
  };
  attribute(shared::kNormalAttribute, 3, offsetof(Attributes, normal));
  attribute(shared::kTangentAttribute, 4, offsetof(Attributes, tangent));
  attribute(shared::kUv0Attribute, 2, offsetof(Attributes, uv0));
  attribute(shared::kUv1Attribute, 2, offsetof(Attributes, uv1));
  attribute(shared::kColorAttribute, 3, offsetof(Attributes, color));
  attribute(shared::kBakeAttribute, 4, offsetof(Attributes, bake));
}

std::uint64_t uploadedGeometryBytes(const scene::Scene& scene) {
  // The vertices and indices of the geometry for OpenGL, and the meshlets with their indices, which
  // are there twice while they are grouped
  const std::uint64_t triangles = scene.triangleCount();
  return frame::geometryBytes(scene) + 2 * triangles * 3 * sizeof(std::uint32_t) +
         triangles / kMeshletTriangles * sizeof(Meshlet);
}

SceneGpu::SceneGpu(const scene::Scene& scene, const frame::Geometry& geometry)
    : materials_(scene),
      meshlets_(buildMeshlets(geometry)),
      brightest_(brightestOf(scene, geometry)),
      diameter_(geometry.bounds.diameter()),
      positions_("positions", std::span<const Vec3>(geometry.positions)),
      attributes_("vertex attributes",
                  std::span<const frame::VertexAttributes>(geometry.attributes)),
      indices_("indices", std::span<const std::uint32_t>(meshlets_.indices)),
      vertices_("scene") {
  raster::describeVertices(vertices_, positions_, attributes_);
  vertices_.setIndices(indices_);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Material& material = scene.materials[object.material];
    const frame::ObjectRange& range = geometry.objects[i];
    const std::uint32_t bend =
        frame::bendsNormals(scene, range, static_cast<int>(i)) ? std::uint32_t{kBend} : 0u;
    objects_.push_back(
        {.material = object.material,
         .sampleClass = objectClass(materials_.classOf(object.material), object),
         .features = materialFeatures(material) | vertexFeatures(geometry, range) | bend,
         .opaque = material.alphaMode == scene::AlphaMode::Opaque,
         .moving = range.moving,
         .emission = largest(material.emissive),
         .bounds = range.bounds,
         .uvPerMetre = range.uvPerMetre});
  }
}

void SceneGpu::update(const frame::Geometry& geometry, std::span<const int> changedObjects) {
  for (const int object : changedObjects) {
    const frame::ObjectRange& range = geometry.objects[object];
    positions_.write(range.firstVertex * sizeof(Vec3), range.vertexCount * sizeof(Vec3),
                     &geometry.positions[range.firstVertex]);
    attributes_.write(range.firstVertex * sizeof(frame::VertexAttributes),
                      range.vertexCount * sizeof(frame::VertexAttributes),
                      &geometry.attributes[range.firstVertex]);
    DeviceObject& changed = objects_[object];
    changed.bounds = range.bounds;
    changed.uvPerMetre = range.uvPerMetre;
    constexpr std::uint32_t ofVertices = kVertexColor | kBakeIrradiance | kBakeVisibility | kSky;
    changed.features = (changed.features & ~ofVertices) | vertexFeatures(geometry, range);
    if (!positionsOfAll_.empty())
      std::copy_n(geometry.positions.begin() + range.firstVertex, range.vertexCount,
                  positionsOfAll_.begin() + range.firstVertex);
    updateMeshletBounds(meshlets_, geometry, object);
    if (levels_.firstOfObject.empty()) continue;
    for (const DetailLevel& level : levels_.ofObject(static_cast<std::size_t>(object))) {
      updateBounds(std::span(levels_.meshlets).subspan(level.firstMeshlet, level.meshletCount),
                   levels_.indices, geometry);
    }
  }
  diameter_ = geometry.bounds.diameter();
}

void SceneGpu::buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                                 const frame::Lighting& lighting,
                                 const std::filesystem::path& cache) {
  std::vector<LevelSource> sources;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const scene::Material& material = scene.materials[object.material];
    Vec3 albedo = material.baseColor;
    if (material.baseColorTexture.used()) {
      albedo *= meanColor(scene.textures[material.baseColorTexture.texture]);
    }
    sources.push_back({.whole = geometry.objects[i].deforms,
                       .moving = geometry.objects[i].moving,
                       .textured = material.baseColorTexture.used(),
                       .albedo = albedo});
  }
  levels_ = cachedDetailLevels(geometry, sources, lighting, cache);
  const auto base = static_cast<std::uint32_t>(meshlets_.indices.size());
  for (Meshlet& meshlet : levels_.meshlets) meshlet.firstIndex += base;
  std::vector<std::uint32_t> all = meshlets_.indices;
  all.insert(all.end(), levels_.indices.begin(), levels_.indices.end());
  levels_.indices = std::move(all);
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i].levelExtent = geometry.objects[i].bounds.diameter();
  }
  if (levels_.places.empty()) return;
  // The levels' own vertices behind those of the geometry
  positionsOfAll_.assign(
      geometry.positions.begin(),
      geometry.positions.begin() + static_cast<std::ptrdiff_t>(geometry.vertexCount()));
  for (const std::uint32_t place : levels_.places)
    positionsOfAll_.push_back(geometry.positions[place]);
  std::vector<frame::VertexAttributes> attributes = geometry.attributes;
  attributes.insert(attributes.end(), levels_.attributes.begin(), levels_.attributes.end());
  positions_ = gl::Buffer("positions", std::span<const Vec3>(positionsOfAll_));
  attributes_ =
      gl::Buffer("vertex attributes", std::span<const frame::VertexAttributes>(attributes));
  raster::describeVertices(vertices_, positions_, attributes_);
  levels_.places = {};
  levels_.attributes = {};
}

void SceneGpu::describeVertices(gl::VertexArray& array, std::uint32_t firstVertex) const {
  raster::describeVertices(array, positions_, attributes_, firstVertex);
}

std::size_t SceneGpu::bytes() const {
  return materials_.bytes() + positions_.size() + attributes_.size() + indices_.size();
}

}  // namespace catoptric::raster
