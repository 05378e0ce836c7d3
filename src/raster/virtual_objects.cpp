#include "raster/virtual_objects.h"

#include <algorithm>
#include <array>

#include "raster/regions/triangle_cover.h"
#include "raster/scene_raster_state.h"

namespace catoptric::raster {
namespace {

/// Texture units of scene.frag.
constexpr GLuint kReflectorUnit = 5;
constexpr GLuint kDepthUnit = 6;

/// So many triangles are rather drawn in vain than left out between two ranges (ours).
constexpr std::size_t kLongestGap = 8;

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
  const TriangleCover cover(camera, width, height);
  std::vector<TriangleCover::Corner> corners;
  corners.reserve(source.images.size());
  for (const Vec4& image : source.images) corners.push_back(cover.corner(Vec3(image)));
  std::vector<std::uint32_t> kept;
  kept.reserve(source.indices.size());
  triangles.reserve(source.indices.size() / 3);
  for (std::size_t i = 0; i < source.indices.size(); i += 3) {
    const std::span<const std::uint32_t> t = std::span(source.indices).subspan(i, 3);
    const Rectangle covered = cover.covered({corners[t[0]], corners[t[1]], corners[t[2]]});
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
