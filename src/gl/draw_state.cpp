#include "gl/draw_state.h"

#include <cassert>

namespace catoptric::gl {
namespace {

constexpr GLuint kColors = 8;         // the least maximum of GL 4.5
constexpr GLuint kClipDistances = 8;  // likewise

DrawScope* innermost = nullptr;

void enable(GLenum what, bool on) {
  (on ? glEnable : glDisable)(what);
}

void apply(const DepthState& depth) {
  enable(GL_DEPTH_TEST, depth.test);
  glDepthFunc(depth.function);
  glDepthMask(depth.write ? GL_TRUE : GL_FALSE);
}

void apply(const StencilState& stencil) {
  enable(GL_STENCIL_TEST, stencil.test);
  glStencilFunc(stencil.function, stencil.reference, stencil.compareMask);
  glStencilMask(stencil.writeMask);
  glStencilOp(GL_KEEP, GL_KEEP, stencil.pass);
}

void apply(const BlendState& blend) {
  enable(GL_BLEND, blend.on);
  glBlendFuncSeparate(blend.sourceColor, blend.targetColor, blend.sourceAlpha, blend.targetAlpha);
}

void apply(const std::optional<Scissor>& scissor) {
  enable(GL_SCISSOR_TEST, scissor.has_value());
  if (scissor) glScissor(scissor->x, scissor->y, scissor->width, scissor->height);
}

/// What differs from `before`; everything where that is null.
void apply(const DrawState& state, const DrawState* before) {
  const bool all = before == nullptr;
  if (all || state.depth != before->depth) apply(state.depth);
  if (all || state.stencil != before->stencil) apply(state.stencil);
  if (all || state.blend != before->blend) apply(state.blend);
  if (all || state.scissor != before->scissor) apply(state.scissor);
  if (all) glCullFace(GL_BACK);
  if (all || state.cullBacks != before->cullBacks) enable(GL_CULL_FACE, state.cullBacks);
  if (all || state.clockwiseFronts != before->clockwiseFronts) {
    glFrontFace(state.clockwiseFronts ? GL_CW : GL_CCW);
  }
  const auto bit = [](std::uint8_t bits, GLuint i) { return (bits >> i & 1u) != 0; };
  for (GLuint i = 0; i < kColors; ++i) {
    const bool written = bit(state.colors, i);
    const GLboolean on = written ? GL_TRUE : GL_FALSE;
    if (all || written != bit(before->colors, i)) glColorMaski(i, on, on, on, on);
  }
  for (GLuint i = 0; i < kClipDistances; ++i) {
    const bool clips = bit(state.clipDistances, i);
    if (all || clips != bit(before->clipDistances, i)) enable(GL_CLIP_DISTANCE0 + i, clips);
  }
}

}  // namespace

DrawScope::DrawScope(const DrawState& state) : state_(state), outer_(innermost) {
  apply(state_, outer_ != nullptr ? &outer_->state_ : nullptr);
  innermost = this;
}

DrawScope::~DrawScope() {
  assert(innermost == this);
  const DrawState none;
  apply(outer_ != nullptr ? outer_->state_ : none, &state_);
  innermost = outer_;
}

void DrawScope::change(const DrawState& state) {
  assert(innermost == this);
  apply(state, &state_);
  state_ = state;
}

const DrawState& DrawScope::current() {
  static const DrawState none;
  return innermost != nullptr ? innermost->state_ : none;
}

}  // namespace catoptric::gl
