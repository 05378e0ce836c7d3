// Move-only owners of GL objects. Each has an empty state and a debug label, and uses direct state
// access (nothing is bound for editing). All need a current gl::Context, to which the object then
// belongs. An object that outlives its context is not deleted any more. Functions throw Error
// (Internal), with the object's label, for sizes that exceed the context's limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gl/api.h"

namespace catoptric::gl {

enum class ObjectKind : std::uint8_t { Buffer, Texture, Framebuffer, VertexArray, Program, Query };

/// The number of live objects of a kind, over all contexts. Leak tests compare it.
std::int64_t liveObjects(ObjectKind kind);

/// Owns one GL name; 0 is the empty state.
template <ObjectKind kind>
class Name {
 public:
  Name() = default;
  /// Takes ownership of `id`, which was just created in the current context, and labels it.
  Name(GLuint id, std::string_view label);
  ~Name() { reset(); }
  Name(Name&& other) noexcept
      : id_(std::exchange(other.id_, 0)), context_(std::exchange(other.context_, 0)) {}
  Name& operator=(Name&& other) noexcept {
    if (this != &other) {
      reset();
      id_ = std::exchange(other.id_, 0);
      context_ = std::exchange(other.context_, 0);
    }
    return *this;
  }
  /// Deletes the object and leaves this empty.
  void reset() noexcept;
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
  std::uint32_t context_ = 0;
};

/// A buffer of fixed size.
class Buffer {
 public:
  Buffer() = default;
  /// A buffer of `size` bytes (at least 1 is allocated), optionally filled with `data`.
  Buffer(std::string_view label, std::size_t size, const void* data = nullptr);
  template <class T>
  Buffer(std::string_view label, std::span<const T> data)
      : Buffer(label, data.size_bytes(), data.data()) {}

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  std::size_t size() const { return empty() ? 0 : size_; }

  void write(std::size_t offset, std::size_t size, const void* data);
  void read(std::size_t offset, std::size_t size, void* data) const;
  void bindStorage(GLuint binding) const;  ///< as shader storage block
  void bindUniform(GLuint binding) const;  ///< as uniform block
  /// `offset`: a multiple of 256 is valid for every driver.
  void bindUniformRange(GLuint binding, std::size_t offset, std::size_t size) const;

 private:
  Name<ObjectKind::Buffer> name_;
  std::size_t size_ = 0;
};

/// A texture of fixed size and sized internal format (GL_RGBA32F, ...): 2D, 2D array, cube map, or
/// a view of a buffer. Default sampling is nearest without mip levels and trilinear with them;
/// edges are clamped.
class Texture {
 public:
  Texture() = default;
  /// `levels` 0: the whole mip chain.
  static Texture make2D(std::string_view label, GLenum format, int width, int height,
                        int levels = 1);
  static Texture makeArray(std::string_view label, GLenum format, int width, int height, int layers,
                           int levels = 1);
  static Texture makeCube(std::string_view label, GLenum format, int faceSize, int levels = 1);
  /// A texel buffer over the whole of `buffer`, which must outlive the texture.
  static Texture makeBuffer(std::string_view label, GLenum format, const Buffer& buffer);

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  GLenum target() const { return empty() ? GLenum{GL_NONE} : target_; }
  GLenum format() const { return empty() ? GLenum{GL_NONE} : format_; }
  int width() const { return empty() ? 0 : width_; }  ///< number of texels for a texel buffer
  int height() const { return empty() ? 0 : height_; }
  int layers() const { return empty() ? 0 : layers_; }  ///< 6 for a cube map, 1 for 2D
  int levels() const { return empty() ? 0 : levels_; }
  std::size_t bytes() const { return empty() ? 0 : bytes_; }  ///< size of all levels and layers

  /// Uploads a whole level (of one layer or face); `pixels` are tightly packed, row 0 first.
  void upload(int level, int layer, GLenum pixelFormat, GLenum pixelType, const void* pixels);
  /// Reads a whole level of all layers, tightly packed, row 0 first.
  void read(int level, GLenum pixelFormat, GLenum pixelType, std::span<std::byte> out) const;
  /// Uploads some rows of level 0 of a 2D texture, tightly packed.
  void uploadRows(int firstRow, int rows, GLenum pixelFormat, GLenum pixelType, const void* pixels);
  /// Uploads a rectangle of level 0 of a 2D texture, tightly packed.
  void uploadPart(int x, int y, int width, int height, GLenum pixelFormat, GLenum pixelType,
                  const void* pixels);
  void readPart(int x, int y, int width, int height, GLenum pixelFormat, GLenum pixelType,
                std::span<std::byte> out) const;
  void readRows(int firstRow, int rows, GLenum pixelFormat, GLenum pixelType,
                std::span<std::byte> out) const;
  template <class T>
  std::vector<T> read(int level, GLenum pixelFormat, GLenum pixelType,
                      std::size_t valuesPerTexel) const {
    std::vector<T> values(static_cast<std::size_t>(levelWidth(level)) * levelHeight(level) *
                          layers() * valuesPerTexel);
    read(level, pixelFormat, pixelType, std::as_writable_bytes(std::span(values)));
    return values;
  }
  int levelWidth(int level) const;
  int levelHeight(int level) const;

  void generateMipmaps();
  void setFilter(GLenum minFilter, GLenum magFilter);
  void setWrap(GLenum s, GLenum t);
  void bind(GLuint unit) const;
  void bindImage(GLuint unit, GLenum access, int level = 0) const;  ///< all layers

 private:
  static Texture make(std::string_view label, GLenum target, GLenum format, int width, int height,
                      int layers, int levels);

  Name<ObjectKind::Texture> name_;
  GLenum target_ = GL_NONE;
  GLenum format_ = GL_NONE;
  int width_ = 0;
  int height_ = 0;
  int layers_ = 0;
  int levels_ = 0;
  std::size_t bytes_ = 0;
};

/// One attachment: a level of a texture. Of arrays and cube maps, one layer (or face) of the level,
/// or all layers.
struct Attachment {
  const Texture& texture;
  int level = 0;
  int layer = -1;  ///< -1: all (layered rendering for arrays and cube maps)
};

/// A framebuffer. It refers to its textures, which must outlive it. Draw buffers are colours 0, 1,
/// ... in order. All attachments have the same size.
class Framebuffer {
 public:
  Framebuffer() = default;
  /// Throws Error (Internal) with the status if the framebuffer is incomplete. The format of the
  /// depth attachment decides whether it is used for depth, stencil or both.
  Framebuffer(std::string_view label, std::initializer_list<Attachment> colors);
  Framebuffer(std::string_view label, std::initializer_list<Attachment> colors,
              const Attachment& depth);
  Framebuffer(std::string_view label, std::span<const Attachment> colors, const Attachment& depth);

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  int width() const { return empty() ? 0 : width_; }
  int height() const { return empty() ? 0 : height_; }

  /// Binds it for drawing and sets the viewport to the whole framebuffer.
  void bind() const;
  void clearColor(int index, float r, float g, float b, float a) const;
  void clearColorUint(int index, std::uint32_t r, std::uint32_t g = 0, std::uint32_t b = 0,
                      std::uint32_t a = 0) const;
  void clearDepth(float depth) const;  ///< with reversed-Z, 0 is infinitely far
  void clearDepthStencil(float depth, int stencil) const;

 private:
  void make(std::string_view label, std::span<const Attachment> colors, const Attachment* depth);
  void attach(GLenum point, const Attachment& attachment, std::string_view label);

  Name<ObjectKind::Framebuffer> name_;
  int width_ = 0;
  int height_ = 0;
};

/// A vertex input layout; its attributes are described once.
class VertexArray {
 public:
  VertexArray() = default;
  explicit VertexArray(std::string_view label);

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }

  /// Attribute `location` consists of `components` values of `type`, at `offset` of every `stride`
  /// bytes.
  void setAttribute(GLuint location, const Buffer& buffer, int components, GLenum type,
                    std::size_t offset, std::size_t stride, bool normalized = false);
  void setPerInstance(GLuint location);  ///< for an attribute that is already set
  void setIndices(const Buffer& buffer);
  void bind() const;

 private:
  void bindAttribute(GLuint location, const Buffer& buffer, std::size_t offset, std::size_t stride);

  Name<ObjectKind::VertexArray> name_;
};

/// Draws one triangle that covers the viewport, for the vertex shader "gl/fullscreen.vert".
void drawFullScreenTriangle();

/// Draws squares of `side` pixels. The vertex shader positions their centres by gl_VertexID.
void drawPoints(std::size_t count, int side);

}  // namespace catoptric::gl
