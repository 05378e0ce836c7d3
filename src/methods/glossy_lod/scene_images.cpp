#include "methods/glossy_lod/scene_images.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "methods/glossy_lod/images/image_cache.h"

namespace catoptric::methods::glossy_lod {
namespace {

constexpr std::uint32_t kMostAtlas = 8192;  ///< texels along a side. Ours: 3 GB of radiance

/// Images that need too much memory are made again for this part of what they may have: several
/// sizes have the same levels. Ours.
constexpr double kRetry = 0.7;

/// Vertices whose memory is asked for before they are placed. Ours.
constexpr std::size_t kSamplesAhead = 16;

/// The bits of `code` at even places.
std::uint32_t everyOther(std::uint64_t code) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 32; ++i) bits |= static_cast<std::uint32_t>(code >> (2 * i) & 1) << i;
  return bits;
}

MeshView viewOf(const scene::Scene& scene, const frame::Geometry& geometry, std::size_t object) {
  const frame::ObjectRange& range = geometry.objects[object];
  const scene::Mesh& source = scene.meshes[scene.objects[object].mesh];
  MeshView mesh{source.positions, {}, source.normals};
  mesh.indices.resize(range.indexCount);
  for (std::uint32_t i = 0; i < range.indexCount; ++i)
    mesh.indices[i] = geometry.indices[range.firstIndex + i] - range.firstVertex;
  return mesh;
}

std::optional<Vec3> middleOfReflectors(const scene::Scene& scene, const frame::Geometry& geometry) {
  Box3 box;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (scene.objects[i].reflector == 0) continue;
    const frame::ObjectRange& range = geometry.objects[i];
    for (std::uint32_t k = 0; k < range.indexCount; ++k)
      box.extend(geometry.positions[geometry.indices[range.firstIndex + k]]);
  }
  if (!(box.min.x <= box.max.x)) return std::nullopt;
  return 0.5f * (box.min + box.max);
}

/// The surface's normals about a chart's quads: those of the triangles on which their corners lie,
/// where these are not on the border.
void addNormals(const frame::Geometry& geometry, const PlacedChart& chart,
                std::vector<Vec3>& normals) {
  const std::size_t quads = std::size_t{1} << chart.image.level;
  const Vec3* const p =
      &geometry.positions[geometry.objects[static_cast<std::size_t>(chart.object)].firstVertex];
  const auto normalAt = [&](std::size_t x, std::size_t y) {
    const std::size_t number = chart.image.firstGrid + y * (quads + 1) + x;
    const auto& v = chart.source->samples[chart.source->grid[number]].vertex;
    return normalizedOr(glm::cross(p[v[1]] - p[v[0]], p[v[2]] - p[v[0]]), Vec3(0.0f));
  };
  for (std::size_t y = 0; y < quads; ++y)
    for (std::size_t x = 0; x < quads; ++x)
      normals.push_back(normalAt(x, y) + normalAt(x + 1, y) + normalAt(x, y + 1) +
                        normalAt(x + 1, y + 1));
}

}  // namespace

SceneImages::MeshImages SceneImages::makeCharts(const scene::Scene& scene,
                                                const frame::Geometry& geometry, const Sizes& sizes,
                                                double share) {
  counts_ = {};
  counts_.reducedObjects = sizes.reduced;
  MeshImages ofMesh;
  charts_.clear();
  firstChart_.assign(1, 0);
  std::uint64_t vertices = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    ImageSize size = sizes.ofObject[i];
    if (size.quads > 0.0) {
      size.quads *= share;
      size.texels *= share;
      std::shared_ptr<const ObjectImage>& image = ofMesh[object.mesh];
      if (!image)
        image = std::make_shared<ObjectImage>(
            cachedObjectImage(viewOf(scene, geometry, i), size, cacheFolder()));
      for (const ChartImage& chart : image->charts) {
        PlacedChart placed{.object = static_cast<int>(i), .image = chart, .source = image.get()};
        placed.firstVertex = static_cast<std::uint32_t>(vertices);
        const std::uint64_t row = (std::uint64_t{1} << chart.level) + 1;
        vertices += row * row;
        counts_.quads += std::uint64_t{1} << (2 * chart.level);
        charts_.push_back(placed);
      }
      counts_.charts += image->charts.size();
      counts_.plainTriangles += image->plainTriangles;
      counts_.degenerateTriangles += image->degenerateTriangles;
      counts_.notFlattened += image->notFlattened;
    }
    firstChart_.push_back(charts_.size());
  }
  return ofMesh;
}

SceneImages::MeshImages SceneImages::makeChartsThatFit(const scene::Scene& scene,
                                                       const frame::Geometry& geometry,
                                                       const Options& options, const Sizes& sizes) {
  // Charts are never coarser than their borders need, and levels are rounded to powers of two
  for (double share = 1.0;;) {
    MeshImages made = makeCharts(scene, geometry, sizes, share);
    double texels = 0.0;
    for (const PlacedChart& chart : charts_)
      texels += std::exp2(2.0 * static_cast<double>(chart.image.texelLevel));
    // A chart has a row and a column of vertices more than of quads
    const auto charts = static_cast<double>(charts_.size());
    const std::uint64_t bytes = imageBytes(static_cast<double>(counts_.quads) + charts, texels);
    if (share < 1.0)
      counts_.reducedObjects = static_cast<std::uint64_t>(std::ranges::count_if(
          sizes.ofObject, [](const ImageSize& size) { return size.quads > 0.0; }));
    if (options.size > 0 || bytes <= options.memoryBytes) return made;
    if (share * std::max(sizes.quads, sizes.texels) < charts)
      throw Error(ExitCode::OutOfMemory,
                  "glossy_lod: the coarsest geometry images need " +
                      std::to_string((bytes >> 20) + 1) +
                      " MiB, more than memory_mib = " + std::to_string(options.memoryBytes >> 20) +
                      ". Raise memory_mib, or set \"objects\" to \"diffuse\"");
    share *= kRetry * static_cast<double>(options.memoryBytes) / static_cast<double>(bytes);
  }
}

void SceneImages::make(const scene::Scene& scene, const frame::Geometry& geometry,
                       const Options& options, const Sizes& sizes) {
  MeshImages ofMesh = makeChartsThatFit(scene, geometry, options, sizes);
  images_.clear();
  double stretch = 0.0;
  double most = 0.0;
  for (auto& [mesh, image] : ofMesh) {
    stretch += image->meanStretch / static_cast<double>(ofMesh.size());
    most = std::max(most, image->mostStretch);
    images_.push_back(std::move(image));
  }
  counts_.meanStretchPercent = static_cast<std::uint64_t>(std::llround(100.0 * stretch));
  counts_.mostStretchPercent = static_cast<std::uint64_t>(std::llround(100.0 * most));
  std::size_t vertices = 0;
  if (!charts_.empty()) {
    const std::size_t row = (std::size_t{1} << charts_.back().image.level) + 1;
    vertices = charts_.back().firstVertex + row * row;
  }
  vertices_.assign(vertices, Vec4(0.0f));
  grids_.clear();
  objects_.clear();
  std::vector<Vec3> normals;
  for (const PlacedChart& chart : charts_) {
    grids_.push_back(
        {chart.firstVertex, static_cast<std::uint32_t>(normals.size()), chart.image.level});
    addNormals(geometry, chart, normals);
    objects_.push_back(static_cast<std::uint32_t>(chart.object) + 1);
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) place(geometry, static_cast<int>(i));
  tree_.build(
      grids_, vertices_, normals,
      options.order == Order::NearFirst ? middleOfReflectors(scene, geometry) : std::nullopt);
  nodes_.assign(scene.objects.size(), {});
  for (std::size_t c = 0; c < charts_.size(); ++c)
    nodes_[static_cast<std::size_t>(charts_[c].object)].extend(
        tree_.nodesOf(static_cast<std::uint32_t>(c)));
  packAtlas();
}

void SceneImages::place(const frame::Geometry& geometry, int object) {
  if (!reflects(object)) return;
  const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(object)];
  const ObjectImage& image = *chartsOf(object).front().source;
  const Vec3* const p = &geometry.positions[range.firstVertex];
  const std::span<const PlacedChart> charts = chartsOf(object);
  parallelFor(charts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const std::size_t row = (std::size_t{1} << charts[c].image.level) + 1;
      const std::uint32_t* const grid = &image.grid[charts[c].image.firstGrid];
      for (std::size_t v = 0; v < row * row; ++v) {
        if (v + kSamplesAhead < row * row)
          for (const std::uint32_t vertex : image.samples[grid[v + kSamplesAhead]].vertex)
            __builtin_prefetch(&p[vertex]);
        const Sample& sample = image.samples[grid[v]];
        const Vec3& p0 = p[sample.vertex[0]];
        vertices_[charts[c].firstVertex + v] = Vec4(
            p0 + sample.w1 * (p[sample.vertex[1]] - p0) + sample.w2 * (p[sample.vertex[2]] - p0),
            0.0f);
      }
    }
  });
}

void SceneImages::packAtlas() {
  // Squares of powers of two, the largest first, along a Z: each lies where its levels need it
  std::vector<std::size_t> order(charts_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts_[a].image.texelLevel > charts_[b].image.texelLevel;
  });
  std::uint64_t at = 0;
  for (const std::size_t c : order) {
    charts_[c].x = everyOther(at);
    charts_[c].y = everyOther(at >> 1);
    at += std::uint64_t{1} << (2 * charts_[c].image.texelLevel);
  }
  atlasSize_ = glm::uvec2(2);
  while (std::uint64_t{atlasSize_.x} * atlasSize_.y < at)
    (atlasSize_.x > atlasSize_.y ? atlasSize_.y : atlasSize_.x) *= 2;
  if (atlasSize_.x > kMostAtlas)
    throw UsageError("glossy_lod: the geometry images need " + std::to_string(at) +
                     " texels, more than a texture can have; lower \"size\"");
}

void SceneImages::follow(const frame::Geometry& geometry, std::span<const int> changedObjects) {
  std::vector<std::uint32_t> charts;
  for (const int object : changedObjects) {
    place(geometry, object);
    for (std::size_t c = firstChart_[object]; c < firstChart_[object + 1]; ++c)
      charts.push_back(static_cast<std::uint32_t>(c));
  }
  if (!charts.empty()) tree_.refit(vertices_, charts);
}

TreeView SceneImages::view() const {
  return {tree_.nodes().data(),
          tree_.quads().data(),
          vertices_.data(),
          objects_.data(),
          static_cast<std::uint32_t>(tree_.nodes().size()),
          {}};
}

}  // namespace catoptric::methods::glossy_lod
