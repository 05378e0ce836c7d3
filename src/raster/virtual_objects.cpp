#include "raster/virtual_objects.h"

#include "raster/scene_raster_state.h"

namespace catoptric::raster {
namespace {

/// Texture units of scene.frag.
constexpr GLuint kObjectUnit = 5;
constexpr GLuint kDepthUnit = 6;

}  // namespace

VirtualObject::VirtualObject(const VirtualTriangles& source)
    : object(source.object),
      reflector(source.reflector),
      depthSlack(source.depthSlack),
      indexCount(static_cast<std::uint32_t>(source.indices.size())),
      positions("virtual object's positions", std::span<const Vec3>(source.positions)),
      attributes("virtual object's attributes",
                 std::span<const frame::VertexAttributes>(source.attributes)),
      images("virtual object's images", std::span<const Vec4>(source.images)),
      indices("virtual object's indices", std::span<const std::uint32_t>(source.indices)),
      vertices("virtual object") {
  describeVertices(vertices, positions, attributes);
  vertices.setAttribute(7, images, 4, GL_FLOAT, 0, sizeof(Vec4));
  vertices.setIndices(indices);
}

void SceneRaster::drawVirtualObjects(std::span<const VirtualObject> objects, const GBuffer& gbuffer,
                                     const scene::Camera& camera, const frame::Lighting& lighting) {
  State& s = *state_;
  s.frame.bind(s.gbufferView, lighting);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  const bool sky = hasSky(lighting);
  for (const VirtualObject& object : objects) {
    if (object.indexCount == 0) continue;
    const auto number = static_cast<std::size_t>(object.object) - 1;
    const ObjectInfo& info = s.objects[number];
    const Variant& v =
        s.variant(diffusePassFeatures(litFeatures(info.features, sky)) | kVirtual, lighting);
    v.program.use();
    s.materials.bind(info.material);
    gbuffer.object.bind(kObjectUnit);
    gbuffer.depth.bind(kDepthUnit);
    if (v.uvPerMetre >= 0) glUniform1f(v.uvPerMetre, s.uvPerMetre[number]);
    glUniform1ui(v.reflector, static_cast<GLuint>(object.reflector));
    glUniform1f(v.depthSlack, object.depthSlack / camera.nearMetres);
    object.vertices.bind();
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(object.indexCount), GL_UNSIGNED_INT, nullptr);
  }
  glDisable(GL_DEPTH_TEST);
}

}  // namespace catoptric::raster
