// The fragment tests and write masks as one value, which is applied for a scope. Outside of all
// scopes the state is a default DrawState: no tests, and everything is written.
#pragma once

#include <cstdint>
#include <optional>

#include "gl/api.h"

namespace catoptric::gl {

/// With reversed-Z, nearer surfaces have greater depth.
struct DepthState {
  bool test = false;
  GLenum function = GL_GREATER;
  bool write = true;
  bool operator==(const DepthState&) const = default;
};

struct StencilState {
  bool test = false;
  GLenum function = GL_ALWAYS;
  int reference = 0;
  GLuint compareMask = 0xFF;
  GLuint writeMask = 0xFF;
  GLenum pass = GL_KEEP;  ///< operation where both tests pass; otherwise the stencil value is kept
  bool operator==(const StencilState&) const = default;
};

struct BlendState {
  bool on = false;
  GLenum sourceColor = GL_ONE;
  GLenum targetColor = GL_ZERO;
  GLenum sourceAlpha = GL_ONE;
  GLenum targetAlpha = GL_ZERO;
  bool operator==(const BlendState&) const = default;
};

/// In pixels, row 0 on top.
struct Scissor {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  bool operator==(const Scissor&) const = default;
};

struct DrawState {
  DepthState depth = {};
  StencilState stencil = {};
  BlendState blend = {};
  bool cullBacks = false;
  bool clockwiseFronts = false;  ///< front faces are clockwise, as in mirrored views
  std::optional<Scissor> scissor = {};
  std::uint8_t colors = 0xFF;        ///< bit i: colour attachment i is written
  std::uint8_t clipDistances = 0x0;  ///< bit i: gl_ClipDistance[i] clips
  bool operator==(const DrawState&) const = default;
};

/// Applies a state during its lifetime and restores the previous one afterwards. Scopes nest.
/// Within a scope, nothing else may change these states.
class DrawScope {
 public:
  explicit DrawScope(const DrawState& state);
  ~DrawScope();
  DrawScope(const DrawScope&) = delete;
  DrawScope& operator=(const DrawScope&) = delete;

  /// Changes to another state; only the differences are sent to GL. Must be the innermost scope.
  void change(const DrawState& state);
  const DrawState& state() const { return state_; }

  /// The state of the innermost scope. A pass starts from it to keep part of its caller's state.
  static const DrawState& current();

 private:
  DrawState state_;
  DrawScope* outer_;
};

}  // namespace catoptric::gl
