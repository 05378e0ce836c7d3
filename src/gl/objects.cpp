#include "gl/objects.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <stdexcept>

#include "core/error.h"
#include "core/log.h"
#include "gl/context.h"
#include "gl/context_state.h"

namespace catoptric::gl {
namespace {

constexpr std::size_t kKinds = 6;
std::array<std::atomic<std::int64_t>, kKinds> liveCounts{};

GLenum labelTarget(ObjectKind kind) {
  switch (kind) {
    case ObjectKind::Buffer:
      return GL_BUFFER;
    case ObjectKind::Texture:
      return GL_TEXTURE;
    case ObjectKind::Framebuffer:
      return GL_FRAMEBUFFER;
    case ObjectKind::VertexArray:
      return GL_VERTEX_ARRAY;
    case ObjectKind::Program:
      return GL_PROGRAM;
    case ObjectKind::Query:
      return GL_QUERY;
  }
  return GL_NONE;
}

void deleteObject(ObjectKind kind, GLuint id) {
  switch (kind) {
    case ObjectKind::Buffer:
      return glDeleteBuffers(1, &id);
    case ObjectKind::Texture:
      return glDeleteTextures(1, &id);
    case ObjectKind::Framebuffer:
      return glDeleteFramebuffers(1, &id);
    case ObjectKind::VertexArray:
      return glDeleteVertexArrays(1, &id);
    case ObjectKind::Program:
      return glDeleteProgram(id);
    case ObjectKind::Query:
      return glDeleteQueries(1, &id);
  }
}

std::string quoted(std::string_view label) {
  return "\"" + std::string(label) + "\"";
}

void requireContext(std::string_view label) {
  if (!Context::hasCurrent()) {
    throw std::logic_error("GL object " + quoted(label) + " made without a current context");
  }
}

// Reports problems of making `label` at once: an allocation that failed must not be used.
void checkMade(std::string_view label) {
  const std::string place = "making " + quoted(label);
  Context::current().check(place.c_str());
}

struct FormatInfo {
  GLenum format;
  std::size_t bytes;  // per texel
  GLenum attachment = GL_COLOR_ATTACHMENT0;
};

constexpr FormatInfo kFormats[] = {
    {GL_R8, 1},
    {GL_RG8, 2},
    {GL_RGBA8, 4},
    {GL_SRGB8_ALPHA8, 4},
    {GL_R8UI, 1},
    {GL_R16UI, 2},
    {GL_R32UI, 4},
    {GL_RG32UI, 8},
    {GL_RGB32UI, 12},
    {GL_RGBA32UI, 16},
    {GL_RGBA8UI, 4},
    {GL_RGBA16UI, 8},
    {GL_R32I, 4},
    {GL_RG32I, 8},
    {GL_RGBA32I, 16},
    {GL_R16F, 2},
    {GL_RG16F, 4},
    {GL_RGBA16F, 8},
    {GL_R32F, 4},
    {GL_RG32F, 8},
    {GL_RGB32F, 12},
    {GL_RGBA32F, 16},
    {GL_R11F_G11F_B10F, 4},
    {GL_RGB10_A2, 4},
    {GL_RG16UI, 4},
    {GL_R16, 2},
    {GL_RG16, 4},
    {GL_RGBA16, 8},
    {GL_DEPTH_COMPONENT32F, 4, GL_DEPTH_ATTACHMENT},
    {GL_DEPTH_COMPONENT24, 4, GL_DEPTH_ATTACHMENT},
    {GL_DEPTH32F_STENCIL8, 8, GL_DEPTH_STENCIL_ATTACHMENT},
    {GL_DEPTH24_STENCIL8, 4, GL_DEPTH_STENCIL_ATTACHMENT},
    {GL_STENCIL_INDEX8, 1, GL_STENCIL_ATTACHMENT},
};

const FormatInfo& formatInfo(GLenum format, std::string_view label) {
  for (const FormatInfo& info : kFormats) {
    if (info.format == format) return info;
  }
  throw std::logic_error("texture " + quoted(label) + ": format " + std::to_string(format) +
                         " is not in the table of formats");
}

bool isIntegerFormat(GLenum format) {
  switch (format) {
    case GL_R8UI:
    case GL_R16UI:
    case GL_R32UI:
    case GL_RG16UI:
    case GL_RG32UI:
    case GL_RGB32UI:
    case GL_RGBA8UI:
    case GL_RGBA16UI:
    case GL_RGBA32UI:
    case GL_R32I:
    case GL_RG32I:
    case GL_RGBA32I:
      return true;
    default:
      return false;
  }
}

int levelSize(int size, int level) {
  return std::max(1, size >> level);
}

void requireSize(std::string_view label, const char* what, std::int64_t value, std::int64_t limit) {
  if (value < 1 || value > limit) {
    throw Error(ExitCode::Internal, "texture " + quoted(label) + ": " + what + " " +
                                        std::to_string(value) + " is not within 1.." +
                                        std::to_string(limit) + ", this device's limit");
  }
}

int chainLength(int width, int height) {
  return std::bit_width(static_cast<unsigned>(std::max(width, height)));
}

// Default sampling: nearest without mip levels (data), trilinear with.
void setDefaultSampling(GLuint id, GLenum format, int levels) {
  const bool linear = levels > 1 && !isIntegerFormat(format);
  glTextureParameteri(
      id, GL_TEXTURE_MIN_FILTER,
      linear ? GL_LINEAR_MIPMAP_LINEAR : (levels > 1 ? GL_NEAREST_MIPMAP_NEAREST : GL_NEAREST));
  glTextureParameteri(id, GL_TEXTURE_MAG_FILTER, linear ? GL_LINEAR : GL_NEAREST);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    glTextureParameteri(id, axis, GL_CLAMP_TO_EDGE);
  }
}

}  // namespace

std::int64_t liveObjects(ObjectKind kind) {
  return liveCounts[static_cast<std::size_t>(kind)];
}

template <ObjectKind kind>
Name<kind>::Name(GLuint id, std::string_view label) : id_(id), context_(Context::currentSerial()) {
  ++liveCounts[static_cast<std::size_t>(kind)];
  if (!label.empty()) {
    // Longer labels are an error in GL; 256 is the least maximum.
    const auto length = static_cast<GLsizei>(std::min<std::size_t>(label.size(), 255));
    glObjectLabel(labelTarget(kind), id_, length, label.data());
  }
}

template <ObjectKind kind>
void Name<kind>::reset() noexcept {
  if (id_ == 0) return;
  if (Context::currentSerial() == context_) {
    deleteObject(kind, id_);
  } else if (contextIsAlive(context_)) {
    // Deleting would hit another context's object of the same number.
    log::error("a GL object was destroyed while another context was current; it is leaked");
  }
  --liveCounts[static_cast<std::size_t>(kind)];
  id_ = 0;
  context_ = 0;
}

template class Name<ObjectKind::Buffer>;
template class Name<ObjectKind::Texture>;
template class Name<ObjectKind::Framebuffer>;
template class Name<ObjectKind::VertexArray>;
template class Name<ObjectKind::Program>;
template class Name<ObjectKind::Query>;

Buffer::Buffer(std::string_view label, std::size_t size, const void* data) : size_(size) {
  requireContext(label);
  GLuint id = 0;
  glCreateBuffers(1, &id);
  name_ = Name<ObjectKind::Buffer>(id, label);
  const std::size_t allocated = std::max<std::size_t>(size, 1);
  glNamedBufferStorage(id, static_cast<GLsizeiptr>(allocated), size > 0 ? data : nullptr,
                       GL_DYNAMIC_STORAGE_BIT);
  checkMade(label);
}

void Buffer::write(std::size_t offset, std::size_t size, const void* data) {
  if (offset + size > size_) throw std::logic_error("write beyond the end of a GL buffer");
  if (size == 0) return;
  glNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(size), data);
}

void Buffer::read(std::size_t offset, std::size_t size, void* data) const {
  if (offset + size > size_) throw std::logic_error("read beyond the end of a GL buffer");
  if (size == 0) return;
  glGetNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(size), data);
}

void Buffer::bindStorage(GLuint binding) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, id());
}

void Buffer::bindUniform(GLuint binding) const {
  glBindBufferBase(GL_UNIFORM_BUFFER, binding, id());
}

void Buffer::bindUniformRange(GLuint binding, std::size_t offset, std::size_t size) const {
  glBindBufferRange(GL_UNIFORM_BUFFER, binding, id(), static_cast<GLintptr>(offset),
                    static_cast<GLsizeiptr>(size));
}

Texture Texture::make2D(std::string_view label, GLenum format, int width, int height, int levels) {
  requireContext(label);
  const Limits& limits = Context::current().info().limits;
  requireSize(label, "width", width, limits.maxTextureSize);
  requireSize(label, "height", height, limits.maxTextureSize);
  return make(label, GL_TEXTURE_2D, format, width, height, 1, levels);
}

Texture Texture::makeArray(std::string_view label, GLenum format, int width, int height, int layers,
                           int levels) {
  requireContext(label);
  const Limits& limits = Context::current().info().limits;
  requireSize(label, "width", width, limits.maxTextureSize);
  requireSize(label, "height", height, limits.maxTextureSize);
  requireSize(label, "layers", layers, limits.maxArrayLayers);
  return make(label, GL_TEXTURE_2D_ARRAY, format, width, height, layers, levels);
}

Texture Texture::makeCube(std::string_view label, GLenum format, int faceSize, int levels) {
  requireContext(label);
  requireSize(label, "face size", faceSize, Context::current().info().limits.maxCubeMapSize);
  return make(label, GL_TEXTURE_CUBE_MAP, format, faceSize, faceSize, 6, levels);
}

Texture Texture::make(std::string_view label, GLenum target, GLenum format, int width, int height,
                      int layers, int levels) {
  const FormatInfo& info = formatInfo(format, label);
  const int chain = chainLength(width, height);
  if (levels < 0 || levels > chain) {
    throw std::logic_error("texture " + quoted(label) + ": " + std::to_string(levels) +
                           " mip levels, the whole chain is " + std::to_string(chain));
  }
  Texture texture;
  texture.target_ = target;
  texture.format_ = format;
  texture.width_ = width;
  texture.height_ = height;
  texture.layers_ = layers;
  texture.levels_ = levels == 0 ? chain : levels;
  for (int level = 0; level < texture.levels_; ++level) {
    texture.bytes_ += info.bytes * static_cast<std::size_t>(levelSize(width, level)) *
                      static_cast<std::size_t>(levelSize(height, level)) *
                      static_cast<std::size_t>(layers);
  }
  GLuint id = 0;
  glCreateTextures(target, 1, &id);
  texture.name_ = Name<ObjectKind::Texture>(id, label);
  if (target == GL_TEXTURE_2D_ARRAY) {
    glTextureStorage3D(id, texture.levels_, format, width, height, layers);
  } else {
    glTextureStorage2D(id, texture.levels_, format, width, height);
  }
  setDefaultSampling(id, format, texture.levels_);
  checkMade(label);
  return texture;
}

Texture Texture::makeBuffer(std::string_view label, GLenum format, const Buffer& buffer) {
  requireContext(label);
  const FormatInfo& info = formatInfo(format, label);
  const std::size_t texels = buffer.size() / info.bytes;
  const std::int64_t limit = Context::current().info().limits.maxTextureBufferTexels;
  if (static_cast<std::int64_t>(texels) > limit) {
    requireSize(label, "texel count", static_cast<std::int64_t>(texels), limit);
  }
  Texture texture;
  texture.target_ = GL_TEXTURE_BUFFER;
  texture.format_ = format;
  texture.width_ = static_cast<int>(texels);
  texture.height_ = 1;
  texture.layers_ = 1;
  texture.levels_ = 1;
  texture.bytes_ = buffer.size();
  GLuint id = 0;
  glCreateTextures(GL_TEXTURE_BUFFER, 1, &id);
  texture.name_ = Name<ObjectKind::Texture>(id, label);
  glTextureBuffer(id, format, buffer.id());
  checkMade(label);
  return texture;
}

int Texture::levelWidth(int level) const {
  return empty() ? 0 : levelSize(width_, level);
}
int Texture::levelHeight(int level) const {
  return empty() ? 0 : levelSize(height_, level);
}

void Texture::upload(int level, int layer, GLenum pixelFormat, GLenum pixelType,
                     const void* pixels) {
  if (target_ == GL_TEXTURE_2D) {
    glTextureSubImage2D(id(), level, 0, 0, levelWidth(level), levelHeight(level), pixelFormat,
                        pixelType, pixels);
  } else {
    glTextureSubImage3D(id(), level, 0, 0, layer, levelWidth(level), levelHeight(level), 1,
                        pixelFormat, pixelType, pixels);
  }
}

void Texture::read(int level, GLenum pixelFormat, GLenum pixelType,
                   std::span<std::byte> out) const {
  glGetTextureImage(id(), level, pixelFormat, pixelType, static_cast<GLsizei>(out.size()),
                    out.data());
}

void Texture::uploadRows(int firstRow, int rows, GLenum pixelFormat, GLenum pixelType,
                         const void* pixels) {
  uploadPart(0, firstRow, width(), rows, pixelFormat, pixelType, pixels);
}

void Texture::uploadPart(int x, int y, int width, int height, GLenum pixelFormat, GLenum pixelType,
                         const void* pixels) {
  glTextureSubImage2D(id(), 0, x, y, width, height, pixelFormat, pixelType, pixels);
}

void Texture::readRows(int firstRow, int rows, GLenum pixelFormat, GLenum pixelType,
                       std::span<std::byte> out) const {
  readPart(0, firstRow, width(), rows, pixelFormat, pixelType, out);
}

void Texture::readPart(int x, int y, int width, int height, GLenum pixelFormat, GLenum pixelType,
                       std::span<std::byte> out) const {
  glGetTextureSubImage(id(), 0, x, y, 0, width, height, 1, pixelFormat, pixelType,
                       static_cast<GLsizei>(out.size()), out.data());
}

void Texture::generateMipmaps() {
  glGenerateTextureMipmap(id());
}

void Texture::setFilter(GLenum minFilter, GLenum magFilter) {
  glTextureParameteri(id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(minFilter));
  glTextureParameteri(id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(magFilter));
}

void Texture::setWrap(GLenum s, GLenum t) {
  glTextureParameteri(id(), GL_TEXTURE_WRAP_S, static_cast<GLint>(s));
  glTextureParameteri(id(), GL_TEXTURE_WRAP_T, static_cast<GLint>(t));
}

void Texture::bind(GLuint unit) const {
  glBindTextureUnit(unit, id());
}

void Texture::bindImage(GLuint unit, GLenum access, int level) const {
  // An empty one unbinds; GL wants a format all the same
  glBindImageTexture(unit, id(), level, GL_TRUE, 0, access, empty() ? GL_RGBA32F : format_);
}

Framebuffer::Framebuffer(std::string_view label, std::initializer_list<Attachment> colors) {
  make(label, std::span(colors.begin(), colors.end()), nullptr);
}

Framebuffer::Framebuffer(std::string_view label, std::initializer_list<Attachment> colors,
                         const Attachment& depth) {
  make(label, std::span(colors.begin(), colors.end()), &depth);
}

Framebuffer::Framebuffer(std::string_view label, std::span<const Attachment> colors,
                         const Attachment& depth) {
  make(label, colors, &depth);
}

void Framebuffer::make(std::string_view label, std::span<const Attachment> colors,
                       const Attachment* depth) {
  requireContext(label);
  GLuint id = 0;
  glCreateFramebuffers(1, &id);
  name_ = Name<ObjectKind::Framebuffer>(id, label);

  // Attach in order; all attachments have one size.
  std::vector<GLenum> drawBuffers;
  for (const Attachment& color : colors) {
    drawBuffers.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(drawBuffers.size()));
    attach(drawBuffers.back(), color, label);
  }
  if (depth != nullptr)
    attach(formatInfo(depth->texture.format(), label).attachment, *depth, label);
  if (drawBuffers.empty()) drawBuffers.push_back(GL_NONE);
  glNamedFramebufferDrawBuffers(id, static_cast<GLsizei>(drawBuffers.size()), drawBuffers.data());
  glNamedFramebufferReadBuffer(id, drawBuffers.front());

  // Refuse an incomplete one now, not at the first draw.
  const GLenum status = glCheckNamedFramebufferStatus(id, GL_DRAW_FRAMEBUFFER);
  checkMade(label);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ExitCode::Internal, "framebuffer " + quoted(label) + " is incomplete (status " +
                                        std::to_string(status) + ")");
  }
}

void Framebuffer::attach(GLenum point, const Attachment& attachment, std::string_view label) {
  const Texture& texture = attachment.texture;
  if (texture.empty()) throw std::logic_error("framebuffer " + quoted(label) + ": empty texture");
  const int width = texture.levelWidth(attachment.level);
  const int height = texture.levelHeight(attachment.level);
  if (width_ == 0) {
    width_ = width;
    height_ = height;
  } else if (width != width_ || height != height_) {
    throw std::logic_error("framebuffer " + quoted(label) + ": attachments of different sizes");
  }
  if (attachment.layer < 0) {
    glNamedFramebufferTexture(id(), point, texture.id(), attachment.level);
  } else {
    glNamedFramebufferTextureLayer(id(), point, texture.id(), attachment.level, attachment.layer);
  }
}

void Framebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, id());
  glViewport(0, 0, width_, height_);
}

void Framebuffer::clearColor(int index, float r, float g, float b, float a) const {
  const std::array<float, 4> value = {r, g, b, a};
  glClearNamedFramebufferfv(id(), GL_COLOR, index, value.data());
}

void Framebuffer::clearColorUint(int index, std::uint32_t r, std::uint32_t g, std::uint32_t b,
                                 std::uint32_t a) const {
  const std::array<GLuint, 4> value = {r, g, b, a};
  glClearNamedFramebufferuiv(id(), GL_COLOR, index, value.data());
}

void Framebuffer::clearDepth(float depth) const {
  glClearNamedFramebufferfv(id(), GL_DEPTH, 0, &depth);
}

void Framebuffer::clearDepthStencil(float depth, int stencil) const {
  glClearNamedFramebufferfi(id(), GL_DEPTH_STENCIL, 0, depth, stencil);
}

VertexArray::VertexArray(std::string_view label) {
  requireContext(label);
  GLuint id = 0;
  glCreateVertexArrays(1, &id);
  name_ = Name<ObjectKind::VertexArray>(id, label);
}

void VertexArray::setAttribute(GLuint location, const Buffer& buffer, int components, GLenum type,
                               std::size_t offset, std::size_t stride, bool normalized) {
  glVertexArrayAttribFormat(id(), location, components, type, normalized ? GL_TRUE : GL_FALSE, 0);
  bindAttribute(location, buffer, offset, stride);
}

// One binding point per attribute: simple, and any attribute may have a buffer of its own.
void VertexArray::bindAttribute(GLuint location, const Buffer& buffer, std::size_t offset,
                                std::size_t stride) {
  glVertexArrayVertexBuffer(id(), location, buffer.id(), static_cast<GLintptr>(offset),
                            static_cast<GLsizei>(stride));
  glVertexArrayAttribBinding(id(), location, location);
  glEnableVertexArrayAttrib(id(), location);
}

void VertexArray::setPerInstance(GLuint location) {
  glVertexArrayBindingDivisor(id(), location, 1);
}

void VertexArray::setIndices(const Buffer& buffer) {
  glVertexArrayElementBuffer(id(), buffer.id());
}

void VertexArray::bind() const {
  glBindVertexArray(id());
}

void drawFullScreenTriangle() {
  glBindVertexArray(emptyVertexArray());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void drawPoints(std::size_t count, int side) {
  glBindVertexArray(emptyVertexArray());
  glPointSize(static_cast<float>(side));
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(count));
}

}  // namespace catoptric::gl
