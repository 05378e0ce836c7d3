#include "gl/shader.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <set>
#include <stdexcept>

#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/text.h"
#include "gl/context.h"
#include "gl/given_shaders.h"

namespace catoptric::gl {
namespace {

// Function-local, since embedded files register themselves before main().
std::map<std::string, const char*>& embeddedFiles() {
  static std::map<std::string, const char*> files;
  return files;
}

std::filesystem::path givenFolder;

[[noreturn]] void fail(const std::string& message) {
  throw Error(ExitCode::Internal, message);
}

// The file's text: of the override folder, else embedded.
std::optional<std::string> findShader(const std::string& name) {
  if (!givenFolder.empty() && std::filesystem::is_regular_file(givenFolder / name)) {
    return readTextFile(givenFolder / name);
  }
  const auto found = embeddedFiles().find(name);
  if (found == embeddedFiles().end()) return std::nullopt;
  return found->second;
}

std::string place(const std::string& file, int line) {
  return file + ":" + std::to_string(line);
}

// The x.glsl of a line `#include "x.glsl"`.
std::optional<std::string> includedName(std::string_view line) {
  const auto skipSpace = [&] {
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  };
  const auto skipWord = [&](std::string_view word) {
    if (!line.starts_with(word)) return false;
    line.remove_prefix(word.size());
    return true;
  };
  skipSpace();
  if (!skipWord("#")) return std::nullopt;
  skipSpace();
  if (!skipWord("include")) return std::nullopt;
  skipSpace();
  if (!skipWord("\"")) return std::nullopt;
  const std::size_t end = line.find('"');
  if (end == std::string_view::npos) return std::nullopt;
  return std::string(line.substr(0, end));
}

class Assembler {
 public:
  // Appends a file and, in place, what it includes.
  void append(const std::string& file, const std::string& text) {
    const std::size_t number = result.files.size();
    result.files.push_back(file);
    appendLineMark(1, number);
    int lineNumber = 0;
    std::size_t begin = 0;
    while (begin < text.size()) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line(text.data() + begin, end - begin);
      begin = end + 1;
      ++lineNumber;
      const std::optional<std::string> included = includedName(line);
      if (!included) {
        result.text.append(line).push_back('\n');
        continue;
      }
      include(*included, file, lineNumber);
      appendLineMark(lineNumber + 1, number);
    }
  }

  ShaderText result;

 private:
  void include(const std::string& name, const std::string& from, int line) {
    const std::filesystem::path beside = std::filesystem::path(from).parent_path() / name;
    for (const std::string& candidate : {beside.lexically_normal().generic_string(), name}) {
      if (const std::optional<std::string> text = findShader(candidate)) {
        if (std::ranges::find(result.files, candidate) == result.files.end()) {
          append(candidate, *text);
        }
        return;
      }
    }
    fail(place(from, line) + ": no shader file \"" + name + "\" to include" +
         didYouMean(name, embeddedShaderNames()));
  }

  void appendLineMark(int line, std::size_t file) {
    result.text += "#line " + std::to_string(line) + " " + std::to_string(file) + "\n";
  }
};

std::optional<int> leadingNumber(std::string_view& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end == text.data()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

// "0:12(5): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:" (others).
std::string namedLine(std::string_view line, const std::vector<std::string>& files) {
  std::string_view rest = line;
  std::string prefix;
  for (const std::string_view word : {"ERROR: ", "WARNING: "}) {
    if (rest.starts_with(word)) {
      prefix = word;
      rest.remove_prefix(word.size());
    }
  }
  const std::optional<int> file = leadingNumber(rest);
  if (!file || *file < 0 || static_cast<std::size_t>(*file) >= files.size() || rest.empty()) {
    return std::string(line);
  }
  const char separator = rest.front();
  if (separator != ':' && separator != '(') return std::string(line);
  rest.remove_prefix(1);
  const std::optional<int> number = leadingNumber(rest);
  if (!number) return std::string(line);
  if (separator == '(' && rest.starts_with(")")) rest.remove_prefix(1);
  return prefix + place(files[static_cast<std::size_t>(*file)], *number) + std::string(rest);
}

std::string describeDefines(const ProgramFiles& options) {
  std::string text;
  for (const Define& define : options.defines) text += " " + define.name + "=" + define.value;
  return text.empty() ? "" : "\n  defines:" + text;
}

struct Stage {
  GLenum type;
  const std::string& file;
};

// A shader object, deleted at the end of its scope.
class Shader {
 public:
  explicit Shader(GLenum type) : id_(glCreateShader(type)) {}
  ~Shader() { glDeleteShader(id_); }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;
  GLuint id() const { return id_; }

 private:
  GLuint id_;
};

template <class GetParameter, class GetLog>
std::string infoLog(GLuint id, GetParameter getParameter, GetLog getLog) {
  GLint length = 0;
  getParameter(id, GL_INFO_LOG_LENGTH, &length);
  std::string text(static_cast<std::size_t>(std::max(length, 1)), '\0');
  GLsizei written = 0;
  getLog(id, static_cast<GLsizei>(text.size()), &written, text.data());
  text.resize(static_cast<std::size_t>(written));
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) {
    text.pop_back();
  }
  return text;
}

bool isIdentifierCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

bool containsIdentifier(const std::string& text, std::string_view word) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const bool startsWord = at == 0 || !isIdentifierCharacter(text[at - 1]);
    const std::size_t end = at + word.size();
    const bool endsWord = end >= text.size() || !isIdentifierCharacter(text[end]);
    if (startsWord && endsWord) return true;
  }
  return false;
}

}  // namespace

void setShaderFolder(const std::filesystem::path& folder) {
  if (!folder.empty() && !std::filesystem::is_directory(folder)) {
    throw UsageError("--shader-dir " + folder.string() +
                     ": not a folder; it must be a copy of src/ with shader files in it");
  }
  givenFolder = folder;
}

const std::filesystem::path& shaderFolder() {
  return givenFolder;
}

std::string givenShaders() {
  if (givenFolder.empty()) return "";
  Fingerprint print;
  for (const auto& [name, embedded] : embeddedFiles()) print.add(*findShader(name));
  return print.text();
}

bool registerShaders(const EmbeddedFile* files, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) embeddedFiles()[files[i].name] = files[i].text;
  return true;
}

std::vector<std::string> embeddedShaderNames() {
  std::vector<std::string> names;
  for (const auto& [name, text] : embeddedFiles()) names.push_back(name);
  return names;
}

ShaderText assembleShader(const std::string& file, const ProgramFiles& options) {
  const std::optional<std::string> text = findShader(file);
  if (!text) {
    fail("there is no shader file \"" + file + "\"" + didYouMean(file, embeddedShaderNames()));
  }
  Assembler assembler;
  std::string& head = assembler.result.text;
  head = "#version 450 core\n";
  for (const Define& define : options.defines) {
    head += "#define " + define.name + " " + define.value + "\n";
  }
  assembler.append(file, *text);
  return std::move(assembler.result);
}

std::string namedLog(const std::string& log, const std::vector<std::string>& files) {
  std::string text;
  std::size_t begin = 0;
  while (begin < log.size()) {
    const std::size_t end = std::min(log.find('\n', begin), log.size());
    if (!text.empty()) text += '\n';
    text += namedLine(std::string_view(log).substr(begin, end - begin), files);
    begin = end + 1;
  }
  return text;
}

Program::Program(std::string_view label, const ProgramFiles& files) : label_(label) {
  if (!Context::hasCurrent()) {
    throw std::logic_error("program \"" + label_ + "\" made without a current context");
  }
  name_ = Name<ObjectKind::Program>(glCreateProgram(), label);

  // Compile each stage.
  const Stage stages[] = {{GL_VERTEX_SHADER, files.vertex},
                          {GL_GEOMETRY_SHADER, files.geometry},
                          {GL_FRAGMENT_SHADER, files.fragment},
                          {GL_COMPUTE_SHADER, files.compute}};
  for (const Stage& stage : stages) {
    if (stage.file.empty()) continue;
    const ShaderText source = assembleShader(stage.file, files);
    const Shader shader(stage.type);
    const char* text = source.text.c_str();
    glShaderSource(shader.id(), 1, &text, nullptr);
    glCompileShader(shader.id());
    GLint compiled = GL_FALSE;
    glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
    const std::string messages =
        namedLog(infoLog(shader.id(), glGetShaderiv, glGetShaderInfoLog), source.files);
    if (compiled == GL_FALSE) {
      // The log says it all; the driver's own messages about it are dropped.
      discardDriverMessages();
      fail("program \"" + label_ + "\": " + stage.file + " does not compile:\n" + messages +
           describeDefines(files));
    }
    if (!messages.empty()) log::debug("program \"" + label_ + "\": " + messages);
    glAttachShader(id(), shader.id());
    text_ += source.text;
  }

  // Link, and free the stages' own objects.
  glLinkProgram(id());
  GLint linked = GL_FALSE;
  glGetProgramiv(id(), GL_LINK_STATUS, &linked);
  if (linked == GL_FALSE) {
    discardDriverMessages();
    fail("program \"" + label_ + "\" does not link:\n" +
         infoLog(id(), glGetProgramiv, glGetProgramInfoLog) + describeDefines(files));
  }
  GLuint attached[4] = {};
  GLsizei count = 0;
  glGetAttachedShaders(id(), 4, &count, attached);
  for (GLsizei i = 0; i < count; ++i) glDetachShader(id(), attached[i]);
  const std::string madeIn = "linking program \"" + label_ + "\"";
  checkErrors(madeIn.c_str());
}

void Program::discardDriverMessages() {
  try {
    checkErrors("compiling");
  } catch (const Error& error) {
    log::debug(error.what());
  }
}

Program Program::fullScreen(std::string_view label, const std::string& fragment,
                            std::vector<Define> defines) {
  ProgramFiles files;
  files.vertex = "gl/fullscreen.vert";
  files.fragment = fragment;
  files.defines = std::move(defines);
  return Program(label, files);
}

void Program::use() const {
  glUseProgram(id());
}

GLint Program::location(std::string_view uniform) const {
  if (const auto known = locations_.find(uniform); known != locations_.end()) return known->second;
  const std::string name(uniform);
  const GLint location = glGetUniformLocation(id(), name.c_str());
  if (location < 0) {
    const std::string_view word = uniform.substr(0, uniform.find_first_of(".["));
    if (!containsIdentifier(text_, word)) {
      throw std::logic_error("program \"" + label_ + "\" has no uniform \"" + name + "\"");
    }
  }
  locations_[name] = location;
  return location;
}

void Program::set(std::string_view uniform, int value) {
  glProgramUniform1i(id(), location(uniform), value);
}
void Program::set(std::string_view uniform, std::uint32_t value) {
  glProgramUniform1ui(id(), location(uniform), value);
}
void Program::set(std::string_view uniform, float value) {
  glProgramUniform1f(id(), location(uniform), value);
}
void Program::set(std::string_view uniform, const Vec2& value) {
  glProgramUniform2fv(id(), location(uniform), 1, &value.x);
}
void Program::set(std::string_view uniform, const Vec3& value) {
  glProgramUniform3fv(id(), location(uniform), 1, &value.x);
}
void Program::set(std::string_view uniform, const Vec4& value) {
  glProgramUniform4fv(id(), location(uniform), 1, &value.x);
}
void Program::set(std::string_view uniform, const glm::ivec2& value) {
  glProgramUniform2iv(id(), location(uniform), 1, &value.x);
}
void Program::set(std::string_view uniform, const Mat3& value) {
  glProgramUniformMatrix3fv(id(), location(uniform), 1, GL_FALSE, &value[0].x);
}
void Program::set(std::string_view uniform, const Mat4& value) {
  glProgramUniformMatrix4fv(id(), location(uniform), 1, GL_FALSE, &value[0].x);
}
void Program::set(std::string_view uniform, std::span<const float> values) {
  if (values.empty()) return;
  glProgramUniform1fv(id(), location(uniform), static_cast<GLsizei>(values.size()), values.data());
}
void Program::set(std::string_view uniform, std::span<const Vec3> values) {
  if (values.empty()) return;
  glProgramUniform3fv(id(), location(uniform), static_cast<GLsizei>(values.size()), &values[0].x);
}
void Program::set(std::string_view uniform, std::span<const Vec4> values) {
  if (values.empty()) return;
  glProgramUniform4fv(id(), location(uniform), static_cast<GLsizei>(values.size()), &values[0].x);
}
void Program::set(std::string_view uniform, std::span<const Mat4> values) {
  if (values.empty()) return;
  glProgramUniformMatrix4fv(id(), location(uniform), static_cast<GLsizei>(values.size()), GL_FALSE,
                            &values[0][0].x);
}
void Program::set(std::string_view sampler, const Texture& texture, GLuint unit) {
  texture.bind(unit);
  set(sampler, static_cast<int>(unit));
}

}  // namespace catoptric::gl
