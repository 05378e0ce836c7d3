// What fragments are tested against and where they are written: one value, applied for a scope.
// Outside of all scopes everything is as a default DrawState says: no tests, all is written.
#pragma once

#include <cstdint>
#include <optional>

#include "gl/api.h"

namespace catoptric::gl {

/// Reversed-Z: what is nearer has the greater depth.
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
  GLenum pass = GL_KEEP;  ///< what becomes of the stencil where both tests pass; else it is kept
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
  bool clockwiseFronts = false;  ///< of views that mirror
  std::optional<Scissor> scissor = {};
  std::uint8_t colors = 0xFF;        ///< bit i: colour i of the framebuffer is written
  std::uint8_t clipDistances = 0x0;  ///< bit i: gl_ClipDistance[i] clips
  bool operator==(const DrawState&) const = default;
};

/// Applies a state while it lives, then the state before. Scopes are nested; within one nothing
/// else changes these states.
class DrawScope {
 public:
  explicit DrawScope(const DrawState& state);
  ~DrawScope();
  DrawScope(const DrawScope&) = delete;
  DrawScope& operator=(const DrawScope&) = delete;

  /// Another state from here on; only what differs is sent to GL. This scope is the innermost.
  void change(const DrawState& state);
  const DrawState& state() const { return state_; }

  /// The innermost scope's: what a pass starts from that leaves some of it to its caller.
  static const DrawState& current();

 private:
  DrawState state_;
  DrawScope* outer_;
};

}  // namespace catoptric::gl
