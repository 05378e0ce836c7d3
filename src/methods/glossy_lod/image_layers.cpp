#include "methods/glossy_lod/image_layers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "core/parallel.h"
#include "methods/glossy_lod/filter.h"

namespace catoptric::methods::glossy_lod {
namespace {

constexpr const char* kChart = "chart";
constexpr const char* kPosition = "image_position";
constexpr const char* kNormal = "image_normal";
constexpr const char* kPlace = "image_place";

/// What a sample sees of the images.
struct Seen {
  std::uint32_t chart = 0;  ///< plus 1; 0: nothing
  Vec3 position{0.0f};
  Vec3 normal{0.0f};  ///< of the triangle
  Vec3 place{0.0f};   ///< in the chart's square; distortion
};

Seen seenBy(const SceneImages& images, const PacketHits& hits, std::size_t lane, const Vec3& eye,
            const Vec3& direction) {
  Seen seen;
  if (hits.node[lane] == kNothing) return seen;
  const Quad& quad = images.tree().quads()[hits.node[lane]];
  const std::uint32_t step = 1u << (quad.place >> 24);
  const auto vertex = [&](std::uint32_t i) { return Vec3(images.vertices()[quad.first + i]); };
  const bool upper = hits.u[lane] + hits.v[lane] > 1.0f;
  const Vec3 corner = vertex(upper ? quad.up + step : 0);
  const Vec3 right = upper ? corner - vertex(quad.up) : vertex(step) - corner;
  const Vec3 up = upper ? corner - vertex(step) : vertex(quad.up) - corner;
  seen.chart = quad.chart + 1;
  seen.position = eye + hits.metres[lane] * direction;
  const Vec3 across = glm::cross(right, up);
  const float area = glm::length(across);
  if (area > 0.0f) seen.normal = across / area;
  const Vec2 place = placeInChart(quad, images.charts()[quad.chart], {hits.u[lane], hits.v[lane]});
  seen.place = Vec3(place, distortion(right, up));
  return seen;
}

}  // namespace

float distortion(const Vec3& right, const Vec3& up) {
  // Singular values of (right up) by the eigenvalues of its 2 x 2 Gram matrix
  const float a = glm::dot(right, right);
  const float b = glm::dot(right, up);
  const float c = glm::dot(up, up);
  const float mean = 0.5f * (a + c);
  if (!(mean > 0.0f)) return 1.0f;
  const float apart = std::hypot(0.5f * (a - c), b);
  return 1.0f - std::sqrt(std::max(0.0f, mean - apart) / (mean + apart));
}

std::vector<SampleLayerInfo> imageLayers() {
  return {{kChart, "number of the sample's chart in the geometry images, from 1; 0: none"},
          {kPosition, "the sample's position on the geometry image, in metres"},
          {kNormal, "normal of the geometry image's triangle there"},
          {kPlace,
           "X, Y: position in the chart's square, 0 to 1. Z: distortion of the quad: 1 minus the "
           "ratio of the smaller to the larger singular value of the quad's map"}};
}

void showImages(const SceneImages& images, const scene::Camera& camera, int width, int height,
                const std::vector<std::string>& asked, std::vector<SampleLayer>& layers) {
  const auto isAsked = [&](const SampleLayerInfo& layer) {
    return std::ranges::find(asked, layer.name) != asked.end();
  };
  if (std::ranges::none_of(imageLayers(), isAsked)) return;
  const auto samples = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<Seen> seen(samples);
  const Mat3 rayFromPixel = scene::rayFromPixel(camera, width, height);
  const Vec3 eye = camera.eye();
  const TreeView tree = images.view();
  parallelFor(samples, 4096, [&](std::size_t begin, std::size_t end) {
    RayPacket packet{};
    PacketHits hits;
    Visits visits;
    for (std::size_t first = begin; first < end; first += RayPacket::kMost) {
      packet.count = std::min(RayPacket::kMost, end - first);
      for (std::size_t i = 0; i < packet.count; ++i) {
        const std::size_t row = (first + i) / static_cast<std::size_t>(width);
        const std::size_t column = (first + i) % static_cast<std::size_t>(width);
        const Vec3 pixel(static_cast<float>(column) + 0.5f, static_cast<float>(row) + 0.5f, 1.0f);
        const Vec3 direction = glm::normalize(rayFromPixel * pixel);
        for (int axis = 0; axis < 3; ++axis) {
          packet.origin[static_cast<std::size_t>(axis)][i] = eye[axis];
          packet.direction[static_cast<std::size_t>(axis)][i] = direction[axis];
        }
      }
      traverse(tree, packet, 0.0f, Levels::Off, hits, visits);
      for (std::size_t i = 0; i < packet.count; ++i)
        seen[first + i] =
            seenBy(images, hits, i, eye,
                   {packet.direction[0][i], packet.direction[1][i], packet.direction[2][i]});
    }
  });
  for (const SampleLayerInfo& info : imageLayers()) {
    if (!isAsked(info)) continue;
    SampleLayer& layer = layers.emplace_back(SampleLayer{info.name, {}});
    for (const Seen& one : seen) {
      if (info.name == kChart) {
        layer.numbers.push_back(one.chart);
      } else {
        layer.vectors.push_back(info.name == kPosition ? one.position
                                : info.name == kNormal ? one.normal
                                                       : one.place);
      }
    }
  }
}

}  // namespace catoptric::methods::glossy_lod
