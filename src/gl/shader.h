// Shader programs from files. The files lie beside the code that uses them, and
// catoptric_embed_shaders() embeds them at build time. Their names are their paths from src/, e.g.
// "raster/gbuffer.frag". `#include "x.glsl"` is searched beside the including file, then from src/.
// Each file is included once. `#version 450 core` and the defines are put in front, so the files
// have no #version line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "gl/objects.h"

namespace catoptric::gl {

/// Reads shader files from this folder (a copy of src/) where they exist there, instead of from the
/// executable. Empty (the default): embedded files only. Throws UsageError if it is not a folder.
void setShaderFolder(const std::filesystem::path& folder);

/// Called by the code that catoptric_embed_shaders() generates.
struct EmbeddedFile {
  const char* name;
  const char* text;
};
bool registerShaders(const EmbeddedFile* files, std::size_t count);
/// Names of all embedded files, sorted.
std::vector<std::string> embeddedShaderNames();

struct Define {
  std::string name;
  std::string value = "1";
};

/// Names of shader files; empty names are unused stages. Either `compute` is set alone, or `vertex`
/// together with other stages.
struct ProgramFiles {
  std::string vertex{};
  std::string geometry{};
  std::string fragment{};
  std::string compute{};
  std::vector<Define> defines{};
};

/// A shader's text with its includes. `files` maps the source-string numbers of messages to files.
struct ShaderText {
  std::string text;
  std::vector<std::string> files;  ///< the index is the source-string number of #line
};
/// Throws Error (Internal), with file and line, if an include is not found.
ShaderText assembleShader(const std::string& file, const ProgramFiles& options);
/// A compiler's log with "source:line" replaced by "file:line" (Mesa's and NVIDIA's forms).
std::string namedLog(const std::string& log, const std::vector<std::string>& files);

class Program {
 public:
  Program() = default;
  /// Compiles and links. Throws Error (Internal) with the compiler's messages, and the defines.
  Program(std::string_view label, const ProgramFiles& files);
  /// A program of the vertex shader "gl/fullscreen.vert" and this fragment shader.
  static Program fullScreen(std::string_view label, const std::string& fragment,
                            std::vector<Define> defines = {});

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  const std::string& label() const { return label_; }
  void use() const;

  /// Sets a uniform. A uniform that the compiler removed as unused is skipped. A name that does not
  /// occur in the shader's text is a bug of the caller (std::logic_error).
  void set(std::string_view uniform, int value);
  void set(std::string_view uniform, std::uint32_t value);
  void set(std::string_view uniform, float value);
  void set(std::string_view uniform, bool value) { set(uniform, value ? 1 : 0); }
  void set(std::string_view uniform, const Vec2& value);
  void set(std::string_view uniform, const Vec3& value);
  void set(std::string_view uniform, const Vec4& value);
  void set(std::string_view uniform, const glm::ivec2& value);
  void set(std::string_view uniform, const Mat3& value);
  void set(std::string_view uniform, const Mat4& value);
  void set(std::string_view uniform, std::span<const float> values);
  void set(std::string_view uniform, std::span<const Vec3> values);
  void set(std::string_view uniform, std::span<const Vec4> values);
  void set(std::string_view uniform, std::span<const Mat4> values);
  /// Binds the texture to `unit` and sets the sampler uniform to it.
  void set(std::string_view sampler, const Texture& texture, GLuint unit);
  /// The location, or -1 if the uniform was removed as unused.
  GLint location(std::string_view uniform) const;

 private:
  static void discardDriverMessages();

  Name<ObjectKind::Program> name_;
  std::string label_;
  std::string text_;  ///< text of all stages, to distinguish removed uniforms from misspelt ones
  mutable std::map<std::string, GLint, std::less<>> locations_;
};

}  // namespace catoptric::gl
