#include "gl/objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <type_traits>

#include "core/error.h"
#include "gl/draw_state.h"
#include "gl/given_shaders.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "gl/test_context.h"

namespace catoptric::gl {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Property;
using testing::Throws;

template <class T>
constexpr bool isMoveOnly =
    !std::is_copy_constructible_v<T> && !std::is_copy_assignable_v<T> &&
    std::is_nothrow_move_constructible_v<T> && std::is_nothrow_move_assignable_v<T>;
static_assert(isMoveOnly<Buffer> && isMoveOnly<Texture> && isMoveOnly<Framebuffer> &&
              isMoveOnly<VertexArray>);
static_assert(!std::is_copy_constructible_v<Program> && std::is_move_constructible_v<Program>);

std::array<std::int64_t, 6> liveCounts() {
  std::array<std::int64_t, 6> counts{};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = liveObjects(static_cast<ObjectKind>(i));
  }
  return counts;
}

std::string labelOf(GLenum kind, GLuint id) {
  std::array<char, 256> text{};
  GLsizei length = 0;
  glGetObjectLabel(kind, id, static_cast<GLsizei>(text.size()), &length, text.data());
  return {text.data(), static_cast<std::size_t>(length)};
}

TEST(Objects, AreEmptyAfterAMoveAndFreeTheirNames) {
  Context& context = testContext();
  const auto before = liveCounts();
  GLuint bufferId = 0;
  GLuint textureId = 0;
  GLuint framebufferId = 0;
  GLuint arrayId = 0;
  GLuint programId = 0;
  {
    Buffer buffer("a buffer", 16);
    Texture texture = Texture::make2D("a texture", GL_RGBA8, 2, 3);
    Framebuffer framebuffer("a framebuffer", {{texture}});
    VertexArray array("an array");
    Program program = Program::fullScreen("a program", "gl/testdata/position.frag");
    bufferId = buffer.id();
    textureId = texture.id();
    framebufferId = framebuffer.id();
    arrayId = array.id();
    programId = program.id();
    EXPECT_EQ(labelOf(GL_BUFFER, bufferId), "a buffer");
    EXPECT_EQ(labelOf(GL_TEXTURE, textureId), "a texture");
    EXPECT_EQ(labelOf(GL_FRAMEBUFFER, framebufferId), "a framebuffer");
    EXPECT_EQ(labelOf(GL_PROGRAM, programId), "a program");
    EXPECT_THAT(liveCounts(), Not(testing::Eq(before)));

    // Each moved-from object says so, the new owner has the name.
    const Buffer movedBuffer = std::move(buffer);
    const Texture movedTexture = std::move(texture);
    const Framebuffer movedFramebuffer = std::move(framebuffer);
    const VertexArray movedArray = std::move(array);
    const Program movedProgram = std::move(program);
    EXPECT_TRUE(buffer.empty() && texture.empty() && framebuffer.empty() && array.empty() &&
                program.empty());
    EXPECT_EQ(buffer.size(), 0u);
    EXPECT_EQ(texture.width(), 0);
    EXPECT_EQ(texture.bytes(), 0u);
    EXPECT_EQ(framebuffer.width(), 0);
    EXPECT_EQ(movedBuffer.id(), bufferId);
    EXPECT_EQ(movedTexture.id(), textureId);
    EXPECT_EQ(movedTexture.width(), 2);
    EXPECT_EQ(movedFramebuffer.height(), 3);
    EXPECT_TRUE(glIsTexture(textureId) && glIsBuffer(bufferId));
  }
  EXPECT_EQ(liveCounts(), before);
  EXPECT_FALSE(glIsBuffer(bufferId));
  EXPECT_FALSE(glIsTexture(textureId));
  EXPECT_FALSE(glIsFramebuffer(framebufferId));
  EXPECT_FALSE(glIsVertexArray(arrayId));
  EXPECT_FALSE(glIsProgram(programId));
  context.check("objects");
}

TEST(Objects, AssignmentFreesTheOldName) {
  testContext();
  Texture texture = Texture::make2D("first", GL_R8, 1, 1);
  const GLuint first = texture.id();
  Texture second = Texture::make2D("second", GL_R8, 1, 1);
  const GLuint secondId = second.id();
  texture = std::move(second);
  EXPECT_FALSE(glIsTexture(first));
  EXPECT_TRUE(glIsTexture(secondId));
  EXPECT_EQ(texture.id(), secondId);
}

TEST(Objects, RefuseSizesBeyondTheDevice) {
  const Context& context = testContext();
  const auto before = liveCounts();
  const int tooMuch = context.info().limits.maxTextureSize + 1;
  EXPECT_THAT([&] { Texture::make2D("wide", GL_R8, tooMuch, 1); },
              Throws<Error>(Property(&Error::what, AllOf(HasSubstr("\"wide\""), HasSubstr("width"),
                                                         HasSubstr(std::to_string(tooMuch))))));
  EXPECT_THROW(Texture::make2D("none", GL_R8, 0, 1), Error);
  EXPECT_THROW(Texture::make2D("levels", GL_R8, 4, 4, 4), std::logic_error);
  EXPECT_EQ(liveCounts(), before);
}

TEST(Objects, TexturesKnowWhatTheyAre) {
  testContext();
  const Texture flat = Texture::make2D("flat", GL_RGBA16F, 5, 3, 0);
  EXPECT_EQ(flat.target(), GLenum{GL_TEXTURE_2D});
  EXPECT_EQ(flat.levels(), 3);
  EXPECT_EQ(flat.bytes(), 8u * (15 + 2 + 1));
  const Texture cube = Texture::makeCube("cube", GL_RGBA32F, 4, 2);
  EXPECT_EQ(cube.target(), GLenum{GL_TEXTURE_CUBE_MAP});
  EXPECT_EQ(cube.layers(), 6);
  EXPECT_EQ(cube.bytes(), 16u * 6 * (16 + 4));
  const Texture array = Texture::makeArray("array", GL_R32UI, 2, 2, 7);
  EXPECT_EQ(array.layers(), 7);
  const Buffer buffer("texels", 48);
  const Texture texels = Texture::makeBuffer("texels", GL_RGB32F, buffer);
  EXPECT_EQ(texels.target(), GLenum{GL_TEXTURE_BUFFER});
  EXPECT_EQ(texels.width(), 4);
}

TEST(Objects, UploadAndReadBack) {
  testContext();
  // Every layer of an array and face of a cube map keeps its own values.
  Texture array = Texture::makeArray("array", GL_R32F, 2, 1, 3);
  Texture cube = Texture::makeCube("cube", GL_R32F, 1);
  for (int layer = 0; layer < 3; ++layer) {
    const std::array<float, 2> values = {static_cast<float>(layer), static_cast<float>(-layer)};
    array.upload(0, layer, GL_RED, GL_FLOAT, values.data());
  }
  for (int face = 0; face < 6; ++face) {
    const float value = static_cast<float>(10 + face);
    cube.upload(0, face, GL_RED, GL_FLOAT, &value);
  }
  EXPECT_THAT(array.read<float>(0, GL_RED, GL_FLOAT, 1), ElementsAre(0, 0, 1, -1, 2, -2));
  EXPECT_THAT(cube.read<float>(0, GL_RED, GL_FLOAT, 1), ElementsAre(10, 11, 12, 13, 14, 15));

  const std::array<float, 3> data = {1, 2, 3};
  Buffer buffer("data", std::span<const float>(data));
  const float changed = 5;
  buffer.write(4, 4, &changed);
  std::array<float, 3> back{};
  buffer.read(0, 12, back.data());
  EXPECT_THAT(back, ElementsAre(1, 5, 3));
  EXPECT_THROW(buffer.write(8, 8, back.data()), std::logic_error);
  EXPECT_THROW(buffer.read(12, 1, back.data()), std::logic_error);
}

TEST(Objects, MipLevelsAreMeans) {
  testContext();
  Texture texture = Texture::make2D("mips", GL_R32F, 2, 2, 0);
  const std::array<float, 4> values = {1, 2, 3, 6};
  texture.upload(0, 0, GL_RED, GL_FLOAT, values.data());
  texture.generateMipmaps();
  EXPECT_THAT(texture.read<float>(1, GL_RED, GL_FLOAT, 1), ElementsAre(3));
}

TEST(Objects, FramebuffersRefuseAttachmentsOfDifferentSizes) {
  testContext();
  const auto before = liveCounts();
  {
    const Texture a = Texture::make2D("a", GL_R8, 2, 2);
    const Texture b = Texture::make2D("b", GL_R8, 3, 2);
    EXPECT_THROW(Framebuffer("ab", {{a}, {b}}), std::logic_error);
  }
  EXPECT_EQ(liveCounts(), before);
}

// Draws a clip-space rectangle at a depth.
struct Rectangle {
  Vec4 bounds;
  float depth;
  Vec4 color;
};

void draw(Program& program, const Rectangle& rectangle) {
  program.use();
  program.set("rectangle", rectangle.bounds);
  program.set("depth", rectangle.depth);
  program.set("color", rectangle.color);
  const VertexArray none("none");
  none.bind();
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

Program patternProgram() {
  ProgramFiles files;
  files.vertex = "gl/testdata/pattern.vert";
  files.fragment = "gl/testdata/pattern.frag";
  return Program("pattern", files);
}

TEST(Draw, RowZeroIsTheTopAndColumnZeroTheLeft) {
  testContext();
  const Texture color = Texture::make2D("color", GL_RGBA32F, 4, 2);
  const Framebuffer target("target", {{color}});
  target.bind();
  target.clearColor(0, 0, 0, 0, 0);
  Program program = patternProgram();
  // Clip space has y up: this is the upper left quarter of the image.
  draw(program, {Vec4(-1, 0, 0, 1), 0.5f, Vec4(1, 0, 0, 1)});
  draw(program, {Vec4(0.5f, -1, 1, 0), 0.5f, Vec4(0, 1, 0, 1)});
  const std::vector<float> red = color.read<float>(0, GL_RED, GL_FLOAT, 1);
  const std::vector<float> green = color.read<float>(0, GL_GREEN, GL_FLOAT, 1);
  EXPECT_THAT(red, ElementsAre(1, 1, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(green, ElementsAre(0, 0, 0, 0, 0, 0, 0, 1));
}

TEST(Draw, FragmentCoordinatesCountFromTheUpperLeft) {
  testContext();
  const Texture color = Texture::make2D("color", GL_RG32F, 2, 2);
  const Framebuffer target("target", {{color}});
  target.bind();
  Program program = Program::fullScreen("position", "gl/testdata/position.frag");
  program.use();
  drawFullScreenTriangle();
  EXPECT_THAT(color.read<float>(0, GL_RG, GL_FLOAT, 2),
              ElementsAre(0.5f, 0.5f, 1.5f, 0.5f, 0.5f, 1.5f, 1.5f, 1.5f));
}

TEST(Draw, ReversedDepthKeepsTheNearerAndItsExactValue) {
  testContext();
  const Texture color = Texture::make2D("color", GL_RGBA32F, 1, 1);
  const Texture depth = Texture::make2D("depth", GL_DEPTH32F_STENCIL8, 1, 1);
  const Framebuffer target("target", {{color}}, {depth});
  target.bind();
  target.clearColor(0, 0, 0, 0, 0);
  target.clearDepthStencil(0.0f, 7);
  const DrawScope scope({.depth = {.test = true, .function = GL_GREATER}});
  Program program = patternProgram();
  // Near plane 0.1 m: depth = 0.1 / distance; 1000 m and 1000.1 m are told apart.
  const Vec4 all(-1, -1, 1, 1);
  draw(program, {all, 0.1f / 1000.0f, Vec4(1)});
  draw(program, {all, 0.1f / 1000.1f, Vec4(2)});
  EXPECT_EQ(color.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 1.0f);
  draw(program, {all, 0.1f / 999.9f, Vec4(3)});
  EXPECT_EQ(color.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 3.0f);
  EXPECT_EQ(depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1)[0], 0.1f / 999.9f);
  EXPECT_EQ(depth.read<std::uint8_t>(0, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE, 1)[0], 7);
}

TEST(Draw, CountsTheFragmentsThatPass) {
  testContext();
  const auto before = liveCounts();
  {
    const Texture color = Texture::make2D("color", GL_R8, 40, 30);
    const Texture stencil = Texture::make2D("stencil", GL_DEPTH32F_STENCIL8, 40, 30);
    const Framebuffer target("target", {{color}}, {stencil});
    const FragmentCounter counter("fragments");
    Program program = patternProgram();
    target.bind();
    target.clearDepthStencil(0.0f, 3);
    counter.begin();
    draw(program, {Vec4(-1, -1, 0, 1), 0.5f, Vec4(1)});
    counter.end();
    EXPECT_EQ(counter.read(), 20u * 30);
    // Of a full-screen triangle, what the stencil lets through
    DrawState state;
    state.stencil = {.test = true, .function = GL_EQUAL, .reference = 2, .compareMask = 0xFE};
    DrawScope scope(state);
    Program position = Program::fullScreen("position", "gl/testdata/position.frag");
    position.use();
    counter.begin();
    drawFullScreenTriangle();
    counter.end();
    EXPECT_EQ(counter.read(), 40u * 30);
    state.stencil.compareMask = 0xFF;
    scope.change(state);
    counter.begin();
    drawFullScreenTriangle();
    counter.end();
    EXPECT_EQ(counter.read(), 0u);
  }
  EXPECT_EQ(liveCounts(), before);
}

TEST(Draw, EveryFaceOfACubeMapIsATarget) {
  Context& context = testContext();
  const Texture cube = Texture::makeCube("cube", GL_RGBA32F, 2, 2);
  for (int face = 0; face < 6; ++face) {
    const Framebuffer target("face", {{cube, 0, face}});
    target.clearColor(0, static_cast<float>(face), 0, 0, 1);
  }
  const std::vector<float> values = cube.read<float>(0, GL_RED, GL_FLOAT, 1);
  for (std::size_t face = 0; face < 6; ++face) {
    EXPECT_THAT(std::vector<float>(values.begin() + static_cast<std::ptrdiff_t>(4 * face),
                                   values.begin() + static_cast<std::ptrdiff_t>(4 * face + 4)),
                Each(static_cast<float>(face)));
  }
  context.check("cube");
}

TEST(Program, TellsRemovedUniformsFromMisspeltOnes) {
  testContext();
  Program program = patternProgram();
  EXPECT_NO_THROW(program.set("unused", 1.0f));
  EXPECT_EQ(program.location("unused"), -1);
  EXPECT_THROW(program.set("colour", Vec4(1)), std::logic_error);
  // A part of a word that is there is not a uniform.
  EXPECT_THROW(program.set("rect", Vec4(1)), std::logic_error);
}

TEST(Program, ErrorsNameFileLineAndDefines) {
  Context& context = testContext();
  const auto before = liveCounts();
  EXPECT_THAT(
      [] {
        Program::fullScreen("broken", "gl/testdata/broken.frag", {{"SIZE", "4"}});
      },
      Throws<Error>(Property(
          &Error::what, AllOf(HasSubstr("\"broken\""), HasSubstr("gl/testdata/broken_part.glsl:3"),
                              HasSubstr("undefinedName"), HasSubstr("SIZE=4")))));
  // Counting goes on behind an include.
  EXPECT_THAT([] { Program::fullScreen("after", "gl/testdata/broken_after.frag"); },
              Throws<Error>(Property(&Error::what, HasSubstr("gl/testdata/broken_after.frag:5"))));
  EXPECT_THAT(
      [] { Program::fullScreen("include", "gl/testdata/broken_include.frag"); },
      Throws<Error>(Property(&Error::what, AllOf(HasSubstr("gl/testdata/broken_include.frag:2"),
                                                 HasSubstr("\"corner.glsl\"")))));
  EXPECT_THAT([] { Program::fullScreen("link", "gl/testdata/broken_link.frag"); },
              Throws<Error>(Property(&Error::what, HasSubstr("\"link\" does not link"))));
  EXPECT_THAT([] { Program::fullScreen("none", "gl/testdata/patern.frag"); },
              Throws<Error>(
                  Property(&Error::what, HasSubstr("did you mean \"gl/testdata/pattern.frag\""))));
  EXPECT_EQ(liveCounts(), before);
  EXPECT_NO_THROW(context.check("after broken programs"));
}

TEST(Program, ShaderFolderOverridesEmbeddedFiles) {
  testContext();
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("shaders" + testDevice().text());
  std::filesystem::create_directories(folder / "gl/testdata");
  std::ofstream(folder / "gl/testdata/pattern.frag") << "layout(location = 0) out vec4 result;\n"
                                                        "void main() { result = vec4(9.0); }\n";
  EXPECT_EQ(givenShaders(), "");
  setShaderFolder(folder);
  Program program = Program::fullScreen("override", "gl/testdata/pattern.frag");
  const std::string given = givenShaders();
  EXPECT_NE(given, "");
  std::ofstream(folder / "gl/testdata/pattern.frag", std::ios::app) << "// longer\n";
  EXPECT_NE(givenShaders(), given);
  setShaderFolder({});
  std::filesystem::remove_all(folder);
  const Texture color = Texture::make2D("color", GL_R32F, 1, 1);
  const Framebuffer target("target", {{color}});
  target.bind();
  program.use();
  drawFullScreenTriangle();
  EXPECT_EQ(color.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 9.0f);
  EXPECT_THROW(setShaderFolder(folder / "missing"), UsageError);
}

}  // namespace
}  // namespace catoptric::gl
