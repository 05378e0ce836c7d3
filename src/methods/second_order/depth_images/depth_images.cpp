#include "methods/second_order/depth_images/depth_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "gl/context.h"
#include "methods/second_order/shaders/constants.h"

namespace catoptric::methods::second_order {
namespace {

namespace shared = second_order_shared;

/// Share of the frame of a cluster whose levels of detail may err twice as much as a large one's.
/// Ours.
constexpr float kSmallCluster = 0.004f;
/// Their error seen from the cluster, radians, at most: walls vanish otherwise. Ours.
constexpr float kWidestError = 0.3f;
/// Factor on the error of levels of detail in planar mirrors: the largest clusters, otherwise
/// exact. Ours: a mirror's pixels then err by less than 0.5 / 255.
constexpr float kMirrorLevel = 0.35f;
/// Texels of a mirrored grid without a sample from which on it is worth while to mask them. Ours,
/// measured in the living room.
constexpr std::int64_t kMaskedTexels = 4096;
constexpr int kMaskTile = 32;       ///< texels along the edge of what is masked at once. Ours.
constexpr int kSmallestSide = 512;  ///< of a layer: small frames need few layers, too. Ours.
constexpr std::uint64_t kBytesPerTexel = 8 + 4;
constexpr std::size_t kTableRows = shared::kTableTexels;

/// A layer's width or height for so many samples.
int sideOf(int samples, float depthImageScale) {
  const float scaled = static_cast<float>(samples) * std::max(1.0f, depthImageScale);
  return std::max(kSmallestSide, static_cast<int>(std::ceil(scaled)));
}

}  // namespace

std::uint64_t DepthImages::usualBytes(int sampleWidth, int sampleHeight, float depthImageScale,
                                      const DepthImageOptions& options) {
  // Ours: the ten scenes of tests/memory.py that reflect have one layer or two
  constexpr std::uint64_t kLayers = 2;
  const auto side = [&](int samples) {
    return static_cast<std::uint64_t>(sideOf(samples, depthImageScale));
  };
  return std::min(options.memoryBytes, kLayers * kBytesPerTexel *
                                           static_cast<std::uint64_t>(options.depthLayers) *
                                           side(sampleWidth) * side(sampleHeight));
}

DepthImages::DepthImages(int sampleWidth, int sampleHeight, float depthImageScale,
                         const DepthImageOptions& options)
    : options_(options) {
  const int limit = gl::Context::current().info().limits.maxTextureSize;
  layerWidth_ = std::min(limit, sideOf(sampleWidth, depthImageScale));
  layerHeight_ = std::min(limit, sideOf(sampleHeight, depthImageScale));
  const std::uint64_t fitting =
      options_.memoryBytes / (kBytesPerTexel * static_cast<std::uint64_t>(options_.depthLayers));
  const auto most = static_cast<double>(fitting);
  const double texels = static_cast<double>(layerWidth_) * layerHeight_;
  if (texels > most) {
    const double factor = std::sqrt(most / texels);
    layerWidth_ = std::max(1, static_cast<int>(layerWidth_ * factor));
    layerHeight_ = std::max(1, static_cast<int>(layerHeight_ * factor));
  }
  sampleWidth_ = sampleWidth;
  frameSamples_ = static_cast<float>(sampleWidth) * static_cast<float>(sampleHeight);
}

bool DepthImages::fits(std::span<const ClusterCamera> cameras) {
  std::vector<AtlasSize> sizes;
  sizes.reserve(cameras.size());
  for (const ClusterCamera& camera : cameras) {
    if (camera.width > layerWidth_ || camera.height > layerHeight_) return false;
    sizes.push_back({camera.width, camera.height});
  }
  atlas_ = packAtlas(sizes, {layerWidth_, layerHeight_});
  return bytes() <= options_.memoryBytes;
}

std::uint64_t DepthImages::layerBytes() const {
  return kBytesPerTexel * static_cast<std::uint64_t>(layerWidth_) *
         static_cast<std::uint64_t>(layerHeight_);
}

DetailCounts DepthImages::draw(std::span<const Cluster> clusters,
                               std::span<const ClusterCamera> cameras,
                               const std::vector<bool>& skipOwn,
                               std::span<const std::uint16_t> samplesOnGrids, const Vec3& frameEye,
                               const frame::Geometry& geometry, const frame::Lighting& lighting,
                               raster::SceneGpu& scene, std::span<std::uint64_t> triangles) {
  const int layers = atlas_.layers * options_.depthLayers;
  if (color_.layers() < layers) {
    targets_.clear();
    color_ = gl::Texture::makeArray("depth images, colour", GL_RGBA16F, layerWidth_, layerHeight_,
                                    layers);
    depth_ = gl::Texture::makeArray("depth images, depth", GL_DEPTH_COMPONENT32F, layerWidth_,
                                    layerHeight_, layers);
    for (int layer = 0; layer < layers; ++layer) {
      targets_.emplace_back(
          "depth images",
          std::initializer_list<gl::Attachment>{{.texture = color_, .layer = layer}},
          gl::Attachment{.texture = depth_, .layer = layer});
    }
  }

  // Views in the order of their layers
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    if (!clusters[i].retraced) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return atlas_.places[a].layer < atlas_.places[b].layer;
  });
  std::vector<DiffuseView> views;
  views.reserve(order.size());
  for (const std::size_t i : order) {
    DiffuseView view;
    view.clipFromWorld = cameras[i].clipFromWorld(frameEye);
    view.eye = frameEye + cameras[i].eye;
    view.texelSpreadRad = cameras[i].texelSpreadRad;
    // Few samples see the errors of a small cluster
    const float allowed = options_.levelErrorTexels *
                          ((cameras[i].mirrorGrid ? kMirrorLevel : 1.0f) +
                           kSmallCluster * frameSamples_ / static_cast<float>(clusters[i].samples));
    view.levelErrorTexels = std::min(allowed, kWidestError / cameras[i].texelSpreadRad);
    const auto object = static_cast<std::size_t>(clusters[i].object);
    view.shown = options_.weight[object];
    view.nearestMetres = cameras[i].nearestMetres;
    if (object < options_.reach.size() && options_.reach[object] > 0.0f) {
      // [Wang2014, section 3.5]: along the camera's axis no ray gets farther than from the farthest
      // sample
      const Vec3 axis(cameras[i].rowW);
      const float until = cameras[i].farthestMetres + options_.reach[object] * glm::length(axis);
      view.farClip = Vec4(-axis, until - cameras[i].rowW.w + glm::dot(axis, frameEye));
    }
    view.layer = atlas_.places[i].layer;
    view.x = atlas_.places[i].x;
    view.y = atlas_.places[i].y;
    view.width = cameras[i].width;
    view.height = cameras[i].height;
    view.ownObject = clusters[i].object;
    view.ownClip =
        Vec4(Vec3(cameras[i].own), cameras[i].own.w - glm::dot(Vec3(cameras[i].own), frameEye));
    view.ownBacks = cameras[i].mirrorGrid;  // its plane says what lies before it
    view.peel = !cameras[i].mirrorGrid;
    view.skipOwn = skipOwn[static_cast<std::size_t>(clusters[i].object)];
    views.push_back(view);
  }
  prepareDepth(clusters, cameras, skipOwn, order, samplesOnGrids);
  std::vector<std::uint64_t> drawn(views.size());
  const ViewLayers targets{.targets = targets_,
                           .peeled = options_.depthLayers > 1 ? &depth_ : nullptr,
                           .compound = options_.compound};
  const DetailCounts detail = diffuse_.draw(scene, views, targets, geometry, lighting, drawn);
  for (std::size_t k = 0; k < order.size(); ++k) triangles[order[k]] = drawn[k];
  writeTable(clusters, cameras, triangles);
  return detail;
}

void DepthImages::writeTable(std::span<const Cluster> clusters,
                             std::span<const ClusterCamera> cameras,
                             std::span<const std::uint64_t> triangles) {
  std::map<int, Vec4> ofObject;  // left, top, right, bottom of all its clusters, samples
  for (const Cluster& cluster : clusters) {
    Vec4& r = ofObject.try_emplace(cluster.object, cluster.left, cluster.top, 0, 0).first->second;
    r = Vec4(std::min(r.x, static_cast<float>(cluster.left)),
             std::min(r.y, static_cast<float>(cluster.top)),
             std::max(r.z, static_cast<float>(cluster.right)),
             std::max(r.w, static_cast<float>(cluster.bottom)));
  }
  std::vector<Vec4> table(std::max<std::size_t>(1, kTableRows * clusters.size()), Vec4(0.0f));
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const ClusterCamera& camera = cameras[i];
    Vec4* rows = &table[kTableRows * i];
    rows[shared::kRowX] = camera.rowX;
    rows[shared::kRowX + 1] = camera.rowY;
    rows[shared::kRowX + 2] = camera.rowW;
    rows[shared::kHorizon] = Vec4(camera.horizon, camera.aboveHorizon);
    // Rays leave an empty image, then of one texel, at once
    const bool empty = triangles[i] == 0 && !camera.mirrorGrid;
    Vec4& place = rows[shared::kPlace];
    place = Vec4(atlas_.places[i].x, atlas_.places[i].y, empty ? 1 : camera.width,
                 empty ? 1 : camera.height);
    // In the atlas already: a planar mirror then needs this row alone
    rows[shared::kMore] = Vec4(atlas_.places[i].layer, camera.mirrorRight + place.x / camera.scale,
                               camera.mirrorTop - place.y / camera.scale, camera.scale);
    const int flags = (camera.crossing || camera.parallel ? shared::kCrossingFlag : 0) +
                      (clusters[i].concave ? shared::kConcaveFlag : 0);
    rows[shared::kFlags] = Vec4(static_cast<float>(flags), 0.0f, 0.0f, 0.0f);
    rows[shared::kRectangle] = ofObject.at(clusters[i].object);
  }
  const std::size_t bytes = table.size() * sizeof(Vec4);
  if (tableBuffer_.size() < bytes) {
    tableBuffer_ = gl::Buffer("clusters", bytes + bytes / 2);
    table_ = gl::Texture::makeBuffer("clusters", GL_RGBA32F, tableBuffer_);
  }
  tableBuffer_.write(0, bytes, table.data());
}

void DepthImages::clearDepth(const Texels& t, float depth) {
  glClearTexSubImage(depth_.id(), 0, t.x, t.y, t.layer, t.width, t.height, 1, GL_DEPTH_COMPONENT,
                     GL_FLOAT, &depth);
}

void DepthImages::maskGrid(const Cluster& cluster, const AtlasPlace& place, std::uint16_t known,
                           std::span<const std::uint16_t> clusterOf) {
  const auto row = [&](int y) {
    return clusterOf.subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(sampleWidth_));
  };
  std::array<float, kMaskTile * kMaskTile> depths;
  for (int top = cluster.top; top < cluster.bottom; top += kMaskTile) {
    const int bottom = std::min(cluster.bottom, top + kMaskTile);
    for (int right = cluster.right; right > cluster.left; right -= kMaskTile) {
      const int left = std::max(cluster.left, right - kMaskTile);
      const int width = right - left;
      std::ptrdiff_t samples = 0;
      for (int y = top; y < bottom; ++y) {
        samples += std::ranges::count(row(y).subspan(left, width), known);
      }
      const Texels tile{place.layer, place.x + cluster.right - right, place.y + top - cluster.top,
                        width, bottom - top};
      if (samples == 0) {
        clearDepth(tile, 1.0f);
      } else if (samples < std::ptrdiff_t{width} * tile.height) {
        float* depth = depths.data();
        for (int y = top; y < bottom; ++y) {
          for (int x = right; x-- > left;) *depth++ = row(y)[x] == known ? 0.0f : 1.0f;
        }
        glTextureSubImage3D(depth_.id(), 0, tile.x, tile.y, tile.layer, width, tile.height, 1,
                            GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
      }
    }
  }
}

void DepthImages::prepareDepth(std::span<const Cluster> clusters,
                               std::span<const ClusterCamera> cameras,
                               const std::vector<bool>& onGrids, std::span<const std::size_t> order,
                               std::span<const std::uint16_t> samplesOnGrids) {
  for (std::size_t first = 0; first < order.size();) {
    const int layer = atlas_.places[order[first]].layer;
    std::size_t last = first;
    int bottom = 0;
    for (; last < order.size() && atlas_.places[order[last]].layer == layer; ++last) {
      bottom = std::max(bottom, atlas_.places[order[last]].y + cameras[order[last]].height);
    }
    clearDepth({layer, 0, 0, layerWidth_, bottom}, 0.0f);
    if (secondLayer() > 0) {
      clearDepth({layer + secondLayer(), 0, 0, layerWidth_, bottom}, 0.0f);
    }

    // Texels that no sample will look at: so near that nothing is drawn
    for (; first < last && !samplesOnGrids.empty(); ++first) {
      const std::size_t i = order[first];
      const ClusterCamera& camera = cameras[i];
      const std::int64_t texels = static_cast<std::int64_t>(camera.width) * camera.height;
      if (!camera.mirrorGrid || !onGrids[static_cast<std::size_t>(clusters[i].object)] ||
          texels - clusters[i].samples < kMaskedTexels) {
        continue;
      }
      maskGrid(clusters[i], atlas_.places[i], static_cast<std::uint16_t>(i + 2), samplesOnGrids);
    }
    first = last;
  }
}

void DepthImages::bind() const {
  table_.bindImage(shared::kTableBinding, GL_READ_ONLY);
  color_.bindImage(shared::kColorImagesBinding, GL_READ_ONLY);
  depth_.bind(shared::kDepthImagesBinding);
}

}  // namespace catoptric::methods::second_order
