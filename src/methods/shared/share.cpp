#include "methods/shared/share.h"

#include <span>
#include <utility>
#include <vector>

#include "gl/draw_state.h"

namespace catoptric::methods {
namespace {

using raster::SampleClass;

// Hidden mirrors have bit 4 set besides 2 (and 1), hidden glossy samples bit 1 besides 4: what no
// class has, nor a test with mask 6 (perturbation's levels) takes for a mirror.
constexpr int kMirror = static_cast<int>(SampleClass::PlanarMirror);
constexpr int kGlossy = static_cast<int>(SampleClass::Glossy);
constexpr int kHidesMirror = 4;
constexpr int kHidesGlossy = 1;
static_assert(kMirror == 2 && static_cast<int>(SampleClass::CurvedMirror) == 3 && kGlossy == 4);

gl::DrawState stencilState(int reference, GLuint compareMask, GLuint writeMask) {
  gl::DrawState state;
  state.stencil = {.test = true,
                   .function = GL_EQUAL,
                   .reference = reference,
                   .compareMask = compareMask,
                   .writeMask = writeMask,
                   .pass = writeMask != 0 ? static_cast<GLenum>(GL_REPLACE) : GL_KEEP};
  state.colors = 0;
  return state;
}

/// Sets the hiding bits of all reflective samples that the bound program passes, or clears them.
void mark(const raster::GBuffer& gbuffer, bool hidden) {
  gbuffer.reflectionFramebuffer.bind();
  // Mirrors, planar and curved, hidden or not; then glossy samples likewise
  gl::DrawScope scope(stencilState(hidden ? kMirror | kHidesMirror : kMirror, 0xFA, kHidesMirror));
  gl::drawFullScreenTriangle();
  scope.change(stencilState(hidden ? kGlossy | kHidesGlossy : kGlossy, 0xFE, kHidesGlossy));
  gl::drawFullScreenTriangle();
}

}  // namespace

Share::Share(std::size_t objects, const frame::ObjectSet& own) {
  const char* file = "methods/shared/shaders/share.frag";
  others_ = gl::Program::fullScreen("others' reflectors", file, {{"OTHERS", "1"}});
  all_ = gl::Program::fullScreen("all reflectors", file, {{"OTHERS", "0"}});
  counter_ = gl::FragmentCounter("samples of a share");
  std::vector<std::uint8_t> owned(objects + 1);
  for (std::size_t i = 0; i < objects; ++i) owned[i + 1] = own.contains(static_cast<int>(i));
  buffer_ = gl::Buffer("own reflectors", std::span<const std::uint8_t>(owned));
  own_ = gl::Texture::makeBuffer("own reflectors", GL_R8UI, buffer_);
}

void Share::hideOthers(const raster::GBuffer& gbuffer) const {
  others_.use();
  gbuffer.object.bind(0);
  own_.bind(1);
  mark(gbuffer, true);
}

void Share::showAll(const raster::GBuffer& gbuffer) const {
  all_.use();
  mark(gbuffer, false);
}

std::uint64_t Share::countShown(const raster::GBuffer& gbuffer) const {
  all_.use();
  gbuffer.reflectionFramebuffer.bind();
  counter_.begin();
  gl::DrawScope scope(stencilState(kMirror, 0xFE, 0));
  gl::drawFullScreenTriangle();
  scope.change(stencilState(kGlossy, 0xFF, 0));
  gl::drawFullScreenTriangle();
  counter_.end();
  return counter_.read();
}

OnlyLeftSamples::OnlyLeftSamples(raster::GBuffer& gbuffer, gl::Texture& left)
    : shown_(gbuffer.object), others_(left) {
  std::swap(shown_, others_);
}

OnlyLeftSamples::~OnlyLeftSamples() {
  std::swap(shown_, others_);
}

MasksBefore::MasksBefore(const raster::GBuffer& gbuffer)
    : before_(gl::Texture::make2D("masks before the fallback", GL_R16UI, gbuffer.sampleWidth(),
                                  gbuffer.sampleHeight())),
      merge_(gl::Program::fullScreen("masks of left samples", "methods/shared/shaders/left.frag",
                                     {})) {}

void MasksBefore::keep(const raster::GBuffer& gbuffer) const {
  const raster::Rectangle all{0, 0, gbuffer.sampleWidth(), gbuffer.sampleHeight()};
  raster::copyTexels(gbuffer.masks, before_, {&all, 1});
  gbuffer.reflectionFramebuffer.clearColorUint(1, 0);
}

void MasksBefore::add(const raster::GBuffer& gbuffer, const gl::Texture& left) {
  gbuffer.reflectionFramebuffer.bind();
  gl::DrawState state;
  state.colors = 0;
  const gl::DrawScope scope(state);
  merge_.use();
  before_.bind(0);
  left.bind(1);
  gbuffer.masks.bindImage(0, GL_READ_WRITE);
  gl::drawFullScreenTriangle();
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                  GL_FRAMEBUFFER_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
}

}  // namespace catoptric::methods
