#include "raster/gbuffer.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "gl/context.h"

namespace catoptric::raster {

gl::DrawState onSamplesOf(SampleClass sampleClass) {
  gl::DrawState state;
  state.stencil = {.test = true, .function = GL_EQUAL, .reference = static_cast<int>(sampleClass)};
  return state;
}

Vec3 lobeHorizonOf(std::uint32_t packed, const Vec3& normal) {
  if (packed == 0) return normal;
  const std::uint32_t bits = packed ^ 0x80008000u;
  const auto component = [](std::uint32_t half) {
    return static_cast<float>(static_cast<std::int16_t>(half)) * (1.0f / 32767.0f);
  };
  const float x = component(bits & 0xFFFFu);
  const float y = component(bits >> 16);
  const float z = 1.0f - std::abs(x) - std::abs(y);
  const float fold = std::max(-z, 0.0f);
  return glm::normalize(Vec3(x >= 0.0f ? x - fold : x + fold, y >= 0.0f ? y - fold : y + fold, z));
}

gl::DrawState onMirrors() {
  // The two classes differ in the last bit only
  static_assert((shared::kClassPlanarMirror ^ shared::kClassCurvedMirror) == 1);
  gl::DrawState state = onSamplesOf(SampleClass::PlanarMirror);
  state.stencil.compareMask = 0xFE;
  return state;
}

std::uint64_t surfaceBytesPerSample(const GBufferSize& size) {
  constexpr std::uint64_t kAlways = 16 + 16 + 4 + 8;  // diffuse, normal, object, depth and stencil
  return kAlways + (size.tints ? 16 : 0) + (size.highlights ? 16 : 0) + (size.lobeHorizons ? 4 : 0);
}

std::uint64_t bytesPerSample(const GBufferSize& size) {
  return surfaceBytesPerSample(size) + 16 + (size.masks ? 2 : 0);
}

GBuffer makeSurfaceSamples(const GBufferSize& size) {
  GBuffer made;
  made.width = size.width;
  made.height = size.height;
  made.samples = size.samples;
  const int width = made.sampleWidth();
  const int height = made.sampleHeight();
  const int limit = gl::Context::current().info().limits.maxTextureSize;
  if (size.width < 1 || size.height < 1 || size.samples < 1 || width > limit || height > limit) {
    throw UsageError("a frame of " + std::to_string(size.width) + " x " +
                     std::to_string(size.height) + " pixels with " + std::to_string(size.samples) +
                     " x " + std::to_string(size.samples) + " samples is " + std::to_string(width) +
                     " x " + std::to_string(height) + " samples; this GL device allows 1 to " +
                     std::to_string(limit) +
                     " along each side: choose a smaller frame or fewer samples");
  }
  made.diffuse = gl::Texture::make2D("G-buffer diffuse", GL_RGBA32F, width, height);
  made.normal = gl::Texture::make2D("G-buffer normal", GL_RGBA32F, width, height);
  made.object = gl::Texture::make2D("G-buffer object", GL_R32UI, width, height);
  made.depth = gl::Texture::make2D("G-buffer depth", GL_DEPTH32F_STENCIL8, width, height);
  if (size.tints) made.tint = gl::Texture::make2D("G-buffer tint", GL_RGBA32F, width, height);
  if (size.highlights)
    made.highlight = gl::Texture::make2D("G-buffer highlight", GL_RGBA32F, width, height);
  if (size.lobeHorizons)
    made.lobeHorizon = gl::Texture::make2D("G-buffer lobe horizon", GL_R32UI, width, height);
  std::vector<gl::Attachment> colors = {
      {.texture = made.diffuse}, {.texture = made.normal}, {.texture = made.object}};
  if (size.tints) colors.push_back({.texture = made.tint});
  if (size.highlights) colors.push_back({.texture = made.highlight});
  if (size.lobeHorizons) colors.push_back({.texture = made.lobeHorizon});
  made.framebuffer =
      gl::Framebuffer("G-buffer", std::span<const gl::Attachment>(colors), {.texture = made.depth});
  return made;
}

GBuffer makeGBuffer(const GBufferSize& size) {
  GBuffer made = makeSurfaceSamples(size);
  const int width = made.sampleWidth();
  const int height = made.sampleHeight();
  made.reflection = gl::Texture::make2D("reflection", GL_RGBA32F, width, height);
  if (size.masks) {
    made.masks = gl::Texture::make2D("masks", GL_R16UI, width, height);
    made.reflectionFramebuffer =
        gl::Framebuffer("reflection", {{.texture = made.reflection}, {.texture = made.masks}},
                        {.texture = made.depth});
  } else {
    made.reflectionFramebuffer =
        gl::Framebuffer("reflection", {{.texture = made.reflection}}, {.texture = made.depth});
  }
  return made;
}

void copyTexels(const gl::Texture& from, const gl::Texture& to,
                std::span<const Rectangle> rectangles) {
  for (const Rectangle& r : rectangles) {
    glCopyImageSubData(from.id(), from.target(), 0, r.x0, r.y0, 0, to.id(), to.target(), 0, r.x0,
                       r.y0, 0, r.width(), r.height(), 1);
  }
}

void readRows(const GBuffer& source, int firstRow, int rows, bool withDiffuse, GBufferCopy& copy) {
  copy.width = source.width;
  copy.height = source.height;
  copy.samples = source.samples;
  copy.firstRow = firstRow;
  copy.rows = rows;
  const std::size_t count =
      static_cast<std::size_t>(source.sampleWidth()) * static_cast<std::size_t>(rows);
  const auto read = [&](const gl::Texture& texture, GLenum format, GLenum type, auto& values,
                        std::size_t perSample) {
    values.resize(count * perSample);
    texture.readRows(firstRow, rows, format, type, std::as_writable_bytes(std::span(values)));
  };
  read(source.normal, GL_RGBA, GL_FLOAT, copy.normal, 4);
  read(source.object, GL_RED_INTEGER, GL_UNSIGNED_INT, copy.object, 1);
  read(source.depth, GL_DEPTH_COMPONENT, GL_FLOAT, copy.depth, 1);
  if (source.lobeHorizon.empty()) {
    copy.lobeHorizon.clear();
  } else {
    read(source.lobeHorizon, GL_RED_INTEGER, GL_UNSIGNED_INT, copy.lobeHorizon, 1);
  }
  if (withDiffuse) {
    read(source.diffuse, GL_RGBA, GL_FLOAT, copy.diffuse, 4);
  } else {
    copy.diffuse.clear();
  }
}

void readBack(const GBuffer& source, bool withDiffuse, GBufferCopy& copy) {
  readRows(source, 0, source.sampleHeight(), withDiffuse, copy);
}

std::vector<float> readRgba(const gl::Texture& texture) {
  return texture.read<float>(0, GL_RGBA, GL_FLOAT, 4);
}

void readRgba(const gl::Texture& texture, std::span<const Rectangle> parts,
              std::span<float> values) {
  const auto width = static_cast<std::size_t>(texture.width());
  glPixelStorei(GL_PACK_ROW_LENGTH, texture.width());
  for (const Rectangle& r : parts) {
    const std::span<float> from = values.subspan(
        4 * (static_cast<std::size_t>(r.y0) * width + static_cast<std::size_t>(r.x0)));
    glGetTextureSubImage(texture.id(), 0, r.x0, r.y0, 0, r.width(), r.height(), 1, GL_RGBA,
                         GL_FLOAT, static_cast<GLsizei>(from.size_bytes()), from.data());
  }
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
}

std::vector<std::uint32_t> readIds(const gl::Texture& texture) {
  return texture.read<std::uint32_t>(0, GL_RED_INTEGER, GL_UNSIGNED_INT, 1);
}

std::vector<float> readDepth(const gl::Texture& texture) {
  return texture.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
}

std::vector<std::uint16_t> readMasks(const gl::Texture& texture) {
  return texture.read<std::uint16_t>(0, GL_RED_INTEGER, GL_UNSIGNED_SHORT, 1);
}

void writeMasks(gl::Texture& texture, std::span<const std::uint16_t> masks) {
  texture.upload(0, 0, GL_RED_INTEGER, GL_UNSIGNED_SHORT, masks.data());
}

}  // namespace catoptric::raster
