#include "raster/passes/surfaces.h"

#include <algorithm>

#include "gl/workarounds.h"

namespace catoptric::raster {
namespace {

/// After so many triangles GL is flushed (gl::Workaround::SoftwareFlushBatches). Ours; the living
/// room's 157k triangles make four batches.
constexpr std::uint64_t kTrianglesPerBatch = 40'000;

}  // namespace

DrawStatistics drawSurfaces(SceneGpu& scene, const FrameView& view, const frame::Lighting& lighting,
                            const SurfacePass& pass, const Selection& selection, DrawList& list) {
  DrawStatistics statistics;
  listVisible(scene, view, selection, list, statistics);
  if (pass.stillFirst) {
    std::stable_partition(
        list.objects.begin(), list.objects.end(),
        [&](const VisibleObject& visible) { return !scene.objects()[visible.object].moving; });
  }
  scene.frame().bind(view, lighting);
  scene.bindVertices();
  PassPrograms& programs = scene.programs().of(pass.shaders, lighting);
  const bool sky = hasSky(lighting);
  gl::DrawState state = pass.state;
  state.clockwiseFronts = view.frontSign <= 0.0f;
  gl::DrawScope scope(state);
  GLuint program = 0;
  int material = -1;
  const bool flushes = gl::worksAround(gl::Workaround::SoftwareFlushBatches);
  std::uint64_t batch = 0;
  for (const VisibleObject& visible : list.objects) {
    const DeviceObject& object = scene.objects()[visible.object];
    const SurfaceProgram& used = programs.of(object.features, sky);
    if (used.program.id() != program) {
      program = used.program.id();
      glUseProgram(program);
    }
    if (object.material != material) {
      material = object.material;
      scene.materials().bind(material);
    }
    // Uniforms that a variant does not have are at -1, where GL ignores them
    glUniform1f(used.uvPerMetre, object.uvPerMetre);
    glUniform1ui(used.objectId, static_cast<GLuint>(visible.object + 1));
    state.cullBacks = visible.cullBacks;
    if (state.stencil.test) state.stencil.reference = static_cast<int>(object.sampleClass);
    if (!selection.parts.empty()) state = within(selection.parts[visible.part], state);
    scope.change(state);
    glMultiDrawElements(GL_TRIANGLES, &list.counts[visible.firstRange], GL_UNSIGNED_INT,
                        &list.offsets[visible.firstRange],
                        static_cast<GLsizei>(visible.rangeCount));
    batch += visible.triangles;
    if (flushes && batch >= kTrianglesPerBatch) {
      glFlush();
      batch = 0;
    }
  }
  return statistics;
}

}  // namespace catoptric::raster
