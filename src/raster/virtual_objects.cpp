#include "raster/virtual_objects.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gl/api.h"
#include "raster/scene_raster_state.h"

namespace catoptric::raster {
namespace {

/// Texture units of scene.frag.
constexpr GLuint kReflectorUnit = 5;
constexpr GLuint kDepthUnit = 6;

/// So many triangles are rather drawn in vain than left out between two ranges (ours).
constexpr std::size_t kLongestGap = 8;

/// Triangles over more samples than that are not looked at one by one (ours).
constexpr int kFewSamples = 64;
/// Rounding of a driver's clip coordinates in floats, in units of their terms (ours: four times
/// what one evaluation may err).
constexpr double kRounding = 16.0 * std::numeric_limits<float>::epsilon();

/// A vertex in the image.
struct Corner {
  glm::dvec2 at{0.0};   ///< samples
  double margin = 0.0;  ///< by which a driver may put it elsewhere
  bool seen = false;    ///< beyond the near plane
};

std::vector<Corner> cornersOf(std::span<const Vec4> images, const scene::Camera& camera, int width,
                              int height) {
  const glm::dvec2 size(width, height);
  const glm::dmat4 rows =
      glm::transpose(glm::dmat4(scene::clipFromCamera(
                         camera, static_cast<float>(width) / static_cast<float>(height))) *
                     glm::dmat4(scene::cameraFromWorld(camera)));
  GLint subpixelBits = 0;
  glGetIntegerv(GL_SUBPIXEL_BITS, &subpixelBits);
  const double snap = std::ldexp(1.0, -subpixelBits);
  std::vector<Corner> corners(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const glm::dvec4 p(glm::dvec3(images[i]), 1.0);
    const glm::dvec3 c(glm::dot(rows[0], p), glm::dot(rows[1], p), glm::dot(rows[3], p));
    Corner& corner = corners[i];
    corner.seen = c.z > static_cast<double>(camera.nearMetres);
    if (!corner.seen) continue;
    corner.at = size * (0.5 + 0.5 * glm::dvec2(c.x, -c.y) / c.z);
    const glm::dvec4 terms = glm::abs(p);
    const double rounding =
        glm::dot(glm::max(glm::abs(rows[0]), glm::abs(rows[1])) + glm::abs(rows[3]), terms) / c.z;
    corner.margin = 2.0 * snap + kRounding * (rounding + 1.0) * std::max(size.x, size.y) +
                    kRounding * glm::length(corner.at);
  }
  return corners;
}

/// The samples whose centres a triangle may cover.
Rectangle coveredBy(const std::array<Corner, 3>& corners, const Rectangle& all) {
  glm::dvec2 low(std::numeric_limits<double>::infinity());
  glm::dvec2 high = -low;
  double margin = 0.0;
  for (const Corner& corner : corners) {
    if (!corner.seen) return all;
    low = glm::min(low, corner.at);
    high = glm::max(high, corner.at);
    margin = std::max(margin, corner.margin);
  }
  if (!(low.x <= high.x && low.y <= high.y)) return {};
  // Far outside, int would overflow
  const glm::dvec2 size(all.x1, all.y1);
  low = glm::clamp(glm::ceil(low - margin - 0.5), glm::dvec2(0.0), size);
  high = glm::clamp(glm::floor(high + margin - 0.5) + 1.0, glm::dvec2(0.0), size);
  const Rectangle box{static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x),
                      static_cast<int>(high.y)};
  if (box.empty() || box.width() > kFewSamples || box.width() * box.height() > kFewSamples)
    return box;

  // Centres on the inner side of all edges, as far as the margin lets one know
  const glm::dvec2 ab = corners[1].at - corners[0].at;
  const glm::dvec2 ac = corners[2].at - corners[0].at;
  const double area = ab.x * ac.y - ab.y * ac.x;
  const auto sum = [](const glm::dvec2& v) { return std::abs(v.x) + std::abs(v.y); };
  if (!(std::abs(area) > 2.0 * margin * (sum(ab) + sum(ac) + 4.0 * margin))) return box;
  Rectangle covered;
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      bool inside = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const glm::dvec2 edge = corners[(c + 1) % 3].at - corners[c].at;
        const glm::dvec2 from = glm::dvec2(x + 0.5, y + 0.5) - corners[c].at;
        const double side = std::copysign(1.0, area) * (edge.x * from.y - edge.y * from.x);
        inside = inside && side >= -margin * (2.0 * sum(from) + sum(edge) + 4.0 * margin);
      }
      if (inside) covered = bounding(covered, {x, y, x + 1, y + 1});
    }
  }
  return covered;
}

/// Ranges of the triangles that may show in `part`.
void listTriangles(const VirtualObject& object, const Rectangle& part, DrawList& list) {
  list.clear();
  if (!object.where.touches(part)) return;
  std::size_t end = 0;  // of the last range, in triangles
  for (std::size_t i = 0; i < object.triangles.size(); ++i) {
    if (intersection(object.triangles[i], part).empty()) continue;
    if (!list.counts.empty() && i - end <= kLongestGap) {
      list.counts.back() += static_cast<GLsizei>(3 * (i + 1 - end));
    } else {
      list.counts.push_back(3);
      list.offsets.push_back(reinterpret_cast<const void*>(3 * i * sizeof(std::uint32_t)));
    }
    end = i + 1;
  }
}

}  // namespace

VirtualObject::VirtualObject(const VirtualTriangles& source, const scene::Camera& camera, int width,
                             int height)
    : object(source.object),
      depthSlack(source.depthSlack),
      where(width, height),
      positions("virtual object's positions", std::span<const Vec3>(source.positions)),
      attributes("virtual object's attributes",
                 std::span<const frame::VertexAttributes>(source.attributes)),
      images("virtual object's images", std::span<const Vec4>(source.images)),
      places(source.places.empty()
                 ? gl::Buffer()
                 : gl::Buffer("virtual object's places", std::span<const Vec3>(source.places))),
      vertices("virtual object") {
  // Without the triangles that cover no sample's centre
  const std::vector<Corner> corners = cornersOf(source.images, camera, width, height);
  std::vector<std::uint32_t> kept;
  kept.reserve(source.indices.size());
  triangles.reserve(source.indices.size() / 3);
  for (std::size_t i = 0; i < source.indices.size(); i += 3) {
    const std::span<const std::uint32_t> t = std::span(source.indices).subspan(i, 3);
    const Rectangle covered =
        coveredBy({corners[t[0]], corners[t[1]], corners[t[2]]}, {0, 0, width, height});
    if (covered.empty()) continue;
    kept.insert(kept.end(), t.begin(), t.end());
    triangles.push_back(covered);
    where.add(covered);
  }
  indices = gl::Buffer("virtual object's indices", std::span<const std::uint32_t>(kept));
  describeVertices(vertices, positions, attributes);
  vertices.setAttribute(7, images, 4, GL_FLOAT, 0, sizeof(Vec4));
  if (!source.places.empty()) vertices.setAttribute(8, places, 3, GL_FLOAT, 0, sizeof(Vec3));
  vertices.setIndices(indices);
}

void SceneRaster::drawVirtualObjects(std::span<const VirtualObject* const> objects,
                                     const VirtualPass& pass, const scene::Camera& camera,
                                     const frame::Lighting& lighting,
                                     std::span<const Rectangle> parts) {
  State& s = *state_;
  s.frame.bind(s.gbufferView, lighting);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  const bool sky = hasSky(lighting);
  for (const VirtualObject* const shown : objects) {
    const VirtualObject& object = *shown;
    if (std::ranges::none_of(parts, [&](const Rectangle& r) { return object.where.touches(r); }))
      continue;
    const auto number = static_cast<std::size_t>(object.object) - 1;
    const ObjectInfo& info = s.objects[number];
    const std::uint32_t lit = litFeatures(info.features, sky);
    const Variant& v = s.variant((pass.continues ? lit | kGBufferPass : diffusePassFeatures(lit)) |
                                     kVirtual | (object.places.size() > 0 ? kPlaces : 0u),
                                 lighting);
    v.program.use();
    s.materials.bind(info.material);
    pass.reflectors.bind(kReflectorUnit);
    pass.depth.bind(kDepthUnit);
    if (v.uvPerMetre >= 0) glUniform1f(v.uvPerMetre, s.uvPerMetre[number]);
    glUniform1ui(v.reflector, object.reflector);
    if (v.objectId >= 0) glUniform1ui(v.objectId, object.next);
    if (v.nextTotal >= 0) glUniform1ui(v.nextTotal, object.nextTotal);
    if (v.refraction >= 0) glUniform1f(v.refraction, object.refraction);
    if (v.fresnel >= 0) glUniform1f(v.fresnel, pass.fresnel ? 1.0f : 0.0f);
    glUniform1f(v.depthSlack, object.depthSlack / camera.nearMetres);
    object.vertices.bind();
    for (const Rectangle& part : parts) {
      listTriangles(object, part, s.list);
      if (s.list.counts.empty()) continue;
      const ScissoredTo scissor(part);
      glMultiDrawElements(GL_TRIANGLES, s.list.counts.data(), GL_UNSIGNED_INT,
                          s.list.offsets.data(), static_cast<GLsizei>(s.list.counts.size()));
    }
  }
  glDisable(GL_DEPTH_TEST);
}

}  // namespace catoptric::raster
