// States are asked of GL itself, and seen in what is drawn.
#include "gl/draw_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gl/objects.h"
#include "gl/shader.h"
#include "gl/test_context.h"

namespace catoptric::gl {
namespace {

using testing::ElementsAre;

GLint integer(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

bool writes(GLuint color) {
  GLboolean mask[4] = {};
  glGetBooleani_v(GL_COLOR_WRITEMASK, color, mask);
  return mask[0] == GL_TRUE && mask[3] == GL_TRUE;
}

/// No field as in a default DrawState.
DrawState everything() {
  DrawState state;
  state.depth = {.test = true, .function = GL_EQUAL, .write = false};
  state.stencil = {.test = true,
                   .function = GL_EQUAL,
                   .reference = 2,
                   .compareMask = 0xFE,
                   .writeMask = 0x0F,
                   .pass = GL_REPLACE};
  state.blend = {.on = true,
                 .sourceColor = GL_DST_ALPHA,
                 .targetColor = GL_ONE_MINUS_DST_ALPHA,
                 .sourceAlpha = GL_ZERO,
                 .targetAlpha = GL_ONE};
  state.cullBacks = true;
  state.clockwiseFronts = true;
  state.scissor = Scissor{1, 2, 3, 4};
  state.colors = 0xFD;
  state.clipDistances = 0x05;
  return state;
}

/// What is bound says which stencil values there can be.
struct StencilTarget {
  Texture stencil = Texture::make2D("stencil", GL_DEPTH32F_STENCIL8, 2, 2);
  Texture color = Texture::make2D("color", GL_R8, 2, 2);
  Framebuffer framebuffer{"target", {{color}}, {stencil}};
  StencilTarget() { framebuffer.bind(); }
};

void expectApplied(const DrawState& state) {
  EXPECT_EQ(glIsEnabled(GL_DEPTH_TEST) == GL_TRUE, state.depth.test);
  EXPECT_EQ(integer(GL_DEPTH_FUNC), static_cast<GLint>(state.depth.function));
  EXPECT_EQ(integer(GL_DEPTH_WRITEMASK), state.depth.write ? 1 : 0);
  EXPECT_EQ(glIsEnabled(GL_STENCIL_TEST) == GL_TRUE, state.stencil.test);
  EXPECT_EQ(integer(GL_STENCIL_FUNC), static_cast<GLint>(state.stencil.function));
  EXPECT_EQ(integer(GL_STENCIL_REF), state.stencil.reference);
  EXPECT_EQ(integer(GL_STENCIL_VALUE_MASK), static_cast<GLint>(state.stencil.compareMask));
  EXPECT_EQ(integer(GL_STENCIL_WRITEMASK), static_cast<GLint>(state.stencil.writeMask));
  EXPECT_EQ(integer(GL_STENCIL_PASS_DEPTH_PASS), static_cast<GLint>(state.stencil.pass));
  EXPECT_EQ(integer(GL_STENCIL_FAIL), GL_KEEP);
  EXPECT_EQ(glIsEnabled(GL_BLEND) == GL_TRUE, state.blend.on);
  EXPECT_EQ(integer(GL_BLEND_SRC_RGB), static_cast<GLint>(state.blend.sourceColor));
  EXPECT_EQ(integer(GL_BLEND_DST_RGB), static_cast<GLint>(state.blend.targetColor));
  EXPECT_EQ(integer(GL_BLEND_SRC_ALPHA), static_cast<GLint>(state.blend.sourceAlpha));
  EXPECT_EQ(integer(GL_BLEND_DST_ALPHA), static_cast<GLint>(state.blend.targetAlpha));
  EXPECT_EQ(glIsEnabled(GL_CULL_FACE) == GL_TRUE, state.cullBacks);
  EXPECT_EQ(integer(GL_CULL_FACE_MODE), GL_BACK);
  EXPECT_EQ(integer(GL_FRONT_FACE), state.clockwiseFronts ? GL_CW : GL_CCW);
  EXPECT_EQ(glIsEnabled(GL_SCISSOR_TEST) == GL_TRUE, state.scissor.has_value());
  if (state.scissor) {
    GLint box[4] = {};
    glGetIntegerv(GL_SCISSOR_BOX, box);
    EXPECT_THAT(box, ElementsAre(state.scissor->x, state.scissor->y, state.scissor->width,
                                 state.scissor->height));
  }
  for (GLuint i = 0; i < 8; ++i) {
    EXPECT_EQ(writes(i), (state.colors >> i & 1) != 0) << i;
    EXPECT_EQ(glIsEnabled(GL_CLIP_DISTANCE0 + i) == GL_TRUE, (state.clipDistances >> i & 1) != 0);
  }
}

TEST(DrawScope, AppliesAllOfAStateAndRestoresTheOneBefore) {
  testContext();
  const StencilTarget target;
  const DrawState none;
  {
    const DrawScope outer(none);
    expectApplied(none);
    {
      const DrawScope inner(everything());
      expectApplied(everything());
      EXPECT_EQ(DrawScope::current(), everything());
    }
    expectApplied(none);
    EXPECT_EQ(DrawScope::current(), none);
  }
  {
    const DrawScope outer(everything());
    expectApplied(everything());
    {
      const DrawScope inner(none);
      expectApplied(none);
    }
    expectApplied(everything());
  }
  expectApplied(none);
}

TEST(DrawScope, ChangesToAnotherState) {
  testContext();
  const StencilTarget target;
  DrawScope scope(everything());
  DrawState next = everything();
  next.stencil.reference = 3;
  next.scissor.reset();
  next.colors = 0x02;
  scope.change(next);
  expectApplied(next);
  scope.change(DrawState());
  expectApplied(DrawState());
}

TEST(DrawScope, OutermostOnesDoNotDependOnWhatWasLeftBehind) {
  testContext();
  glEnable(GL_BLEND);
  glDepthMask(GL_FALSE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  const DrawScope scope{DrawState()};
  expectApplied(DrawState());
}

TEST(DrawScope, ColoursThatAreNotWrittenKeepTheirValues) {
  Context& context = testContext();
  const Texture color = Texture::make2D("color", GL_RGBA32F, 2, 1);
  const Framebuffer target("target", {{color}});
  target.bind();
  Program program = Program::fullScreen("position", "gl/testdata/position.frag");
  program.use();
  DrawState state;
  DrawScope scope(state);
  target.clearColor(0, 7.0f, 7.0f, 7.0f, 7.0f);
  state.scissor = Scissor{1, 0, 1, 1};
  scope.change(state);
  drawFullScreenTriangle();
  state.scissor.reset();
  state.colors = 0;
  scope.change(state);
  drawFullScreenTriangle();
  context.check("draws");
  EXPECT_THAT(color.read<float>(0, GL_RG, GL_FLOAT, 2), ElementsAre(7.0f, 7.0f, 1.5f, 0.5f));
}

}  // namespace
}  // namespace catoptric::gl
