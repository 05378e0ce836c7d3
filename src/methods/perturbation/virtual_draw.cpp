#include "methods/perturbation/virtual_draw.h"

#include <algorithm>
#include <array>

#include "raster/passes/visible.h"
#include "raster/regions/triangle_cover.h"
#include "raster/scene_gpu/scene_gpu.h"

namespace catoptric::methods::perturbation {
namespace {

using raster::DrawList;
using raster::Rectangle;

#include "methods/perturbation/shaders/virtual_constants.glsl"

raster::SurfaceShaders virtualShaders(bool continues, bool places, bool tints) {
  std::uint32_t onward = raster::kNormalOutput | raster::kSpecularOutput;
  if (tints) onward |= raster::kTintOutput;
  return {.label = "virtual objects",
          .vertex = "methods/perturbation/shaders/virtual.vert",
          .fragment = "methods/perturbation/shaders/virtual.frag",
          .outputs = raster::kRadianceOutput | (continues ? onward : 0u),
          .defines = {{"PLACES", places ? "1" : "0"}}};
}

template <class T>
gl::Buffer bufferOf(const char* label, const std::vector<T>& items) {
  return items.empty() ? gl::Buffer() : gl::Buffer(label, std::span<const T>(items));
}

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

VirtualObject::VirtualObject(const VirtualTriangles& source, const raster::SceneGpu& scene,
                             const scene::Camera& camera, int width, int height)
    : object(source.object),
      depthSlack(source.depthSlack),
      where(width, height),
      positions(bufferOf("virtual object's positions", source.positions)),
      attributes(bufferOf("virtual object's attributes", source.attributes)),
      images("virtual object's images", std::span<const Vec4>(source.images)),
      places(bufferOf("virtual object's places", source.places)),
      vertices("virtual object") {
  // Without the triangles that cover no sample's centre
  const raster::TriangleCover cover(camera, width, height);
  std::vector<raster::TriangleCover::Corner> corners;
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
  if (source.positions.empty())
    scene.describeVertices(vertices, source.firstVertex);
  else
    raster::describeVertices(vertices, positions, attributes);
  vertices.setAttribute(kImageAttribute, images, 4, GL_FLOAT, 0, sizeof(Vec4));
  if (!source.places.empty())
    vertices.setAttribute(kPlaceAttribute, places, 3, GL_FLOAT, 0, sizeof(Vec3));
  vertices.setIndices(indices);
}

std::uint64_t VirtualObject::bytes() const {
  return kObjectBytes + positions.size() + attributes.size() + images.size() + places.size() +
         indices.size() + triangles.size() * sizeof(Rectangle);
}

void drawVirtualObjects(raster::SceneRaster& raster, std::span<const VirtualObject* const> objects,
                        const VirtualPass& pass, const scene::Camera& camera,
                        const frame::Lighting& lighting, std::span<const Rectangle> parts) {
  raster::SceneGpu& device = raster.scene();
  device.frame().bind(raster.gbufferView(), lighting);
  gl::DrawState state;
  state.depth.test = true;
  state.stencil = pass.stencil;
  gl::DrawScope scope(state);
  const bool sky = raster::hasSky(lighting);
  DrawList list;
  for (const VirtualObject* const shown : objects) {
    const VirtualObject& object = *shown;
    if (std::ranges::none_of(parts, [&](const Rectangle& r) { return object.where.touches(r); }))
      continue;
    const auto number = static_cast<std::size_t>(object.object) - 1;
    const raster::DeviceObject& info = device.objects()[number];
    raster::PassPrograms& programs = device.programs().of(
        virtualShaders(pass.continues, object.places.size() > 0, device.materials().tintVaries()),
        lighting);
    const raster::SurfaceProgram& v = programs.of(info.features, sky);
    v.program.use();
    device.materials().bind(info.material);
    pass.reflectors.bind(kReflectorUnit);
    pass.depth.bind(kDepthUnit);
    glUniform1f(v.uvPerMetre, info.uvPerMetre);
    glUniform1ui(v.objectId, object.next);
    glUniform1ui(v.program.location("reflector"), object.reflector);
    glUniform1ui(v.program.location("nextTotal"), object.nextTotal);
    glUniform1f(v.program.location("refraction"), object.refraction);
    glUniform1f(v.program.location("fresnel"), pass.fresnel ? 1.0f : 0.0f);
    glUniform1f(v.program.location("depthSlack"), object.depthSlack / camera.nearMetres);
    object.vertices.bind();
    for (const Rectangle& part : parts) {
      listTriangles(object, part, list);
      if (list.counts.empty()) continue;
      scope.change(raster::within(part, state));
      glMultiDrawElements(GL_TRIANGLES, list.counts.data(), GL_UNSIGNED_INT, list.offsets.data(),
                          static_cast<GLsizei>(list.counts.size()));
    }
  }
}

}  // namespace catoptric::methods::perturbation
