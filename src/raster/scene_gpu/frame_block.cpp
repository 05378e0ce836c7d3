#include "raster/scene_gpu/frame_block.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "raster/constants.h"
#include "scene/loader.h"

namespace catoptric::raster {
namespace {

/// std140 of the block before the lights.
struct Block {
  Mat4 clipFromWorld;
  Mat4 rayFromWindow;
  Vec4 eye;
  Vec4 ambient;
  Vec4 environment[3];
  Vec4 environmentTurn;
  Vec4 irradianceSh[9];
};
struct LightBlock {
  Vec4 positionRange;
  Vec4 directionOuter;
  Vec4 intensityCone;
};

/// Constant factors of the harmonics, in the order of frame/shading.h.
constexpr float kHarmonics[9] = {0.282095f, 0.488603f, 0.488603f, 0.488603f, 1.092548f,
                                 1.092548f, 0.315392f, 1.092548f, 0.546274f};

}  // namespace

FrameView makeView(const Mat4& clipFromWorld, const Vec3& eye, float spreadRad,
                   const Vec4& viewport, float radianceLimit) {
  FrameView view;
  view.clipFromWorld = clipFromWorld;
  view.eye = eye;
  view.spreadRad = spreadRad;
  view.radianceLimit = radianceLimit;

  // Window coordinates to the eye's frame, in double: positions are differences of large numbers
  glm::dmat4 clipFromEye(clipFromWorld);
  clipFromEye[3] += clipFromEye * glm::dvec4(glm::dvec3(eye), 0.0);
  // Views whose centre is the eye map it to w = 0 exactly; rounding must not move it
  const double scale =
      std::abs(clipFromEye[0].w) + std::abs(clipFromEye[1].w) + std::abs(clipFromEye[2].w);
  if (std::abs(clipFromEye[3].w) < 1e-4 * scale) {
    clipFromEye[3].x = 0.0;
    clipFromEye[3].y = 0.0;
    clipFromEye[3].w = 0.0;
  }
  const double width = viewport.z;
  const double height = viewport.w;
  glm::dmat4 clipFromWindow(1.0);
  clipFromWindow[0][0] = 2.0 / width;
  clipFromWindow[1][1] = -2.0 / height;
  clipFromWindow[3][0] = -1.0 - 2.0 * viewport.x / width;
  clipFromWindow[3][1] = 1.0 + 2.0 * viewport.y / height;
  const glm::dmat4 ray = glm::inverse(clipFromEye) * clipFromWindow;
  view.rayFromWindow = Mat4(ray);

  // A right-handed view has a negative determinant of its rows x, y, w
  const Mat4 rows = glm::transpose(clipFromWorld);
  const float handedness = glm::dot(glm::cross(Vec3(rows[0]), Vec3(rows[1])), Vec3(rows[3]));
  view.frontSign = handedness < 0.0f ? 1.0f : -1.0f;
  return view;
}

std::string lightSignature(const frame::Lighting& lighting) {
  std::string signature;
  for (const frame::WorldLight& light : lighting.lights) {
    signature += light.type == scene::LightType::Directional ? 'd'
                 : light.type == scene::LightType::Point     ? 'p'
                                                             : 's';
  }
  return signature;
}

std::vector<gl::Define> lightDefines(const frame::Lighting& lighting) {
  if (lighting.lights.size() > scene::kMaxUnbakedLights) {
    throw SceneError("the scene has " + std::to_string(lighting.lights.size()) +
                     " lights that are not baked; at most " +
                     std::to_string(scene::kMaxUnbakedLights) +
                     " are allowed; set \"baked\": true for some of them");
  }
  std::string sum;
  std::string highlights;
  for (std::size_t i = 0; i < lighting.lights.size(); ++i) {
    if (i > 0) sum += " + ";
    if (i > 0) highlights += " + ";
    const std::string number = std::to_string(i);
    const bool directional = lighting.lights[i].type == scene::LightType::Directional;
    const bool spot = lighting.lights[i].type == scene::LightType::Spot;
    highlights += (directional ? "directionalHighlight("
                   : spot      ? "spotHighlight("
                               : "pointHighlight(") +
                  number + ", x, lobe)";
    switch (lighting.lights[i].type) {
      case scene::LightType::Directional:
        sum += "directionalLight(" + number + ", n)";
        break;
      case scene::LightType::Point:
        sum += "pointLight(" + number + ", x, n)";
        break;
      case scene::LightType::Spot:
        sum += "spotLight(" + number + ", x, n)";
        break;
    }
  }
  return {{"LIGHT_COUNT", std::to_string(lighting.lights.size())},
          {"LIGHT_SUM", sum.empty() ? "vec3(0.0)" : sum},
          {"HIGHLIGHT_SUM", highlights.empty() ? "vec3(0.0)" : highlights}};
}

std::string environmentType(const frame::Lighting& lighting) {
  if (!lighting.environment) return "0";
  switch (lighting.environment->description().type) {
    case scene::EnvironmentType::Gradient:
      return "1";
    case scene::EnvironmentType::File:
      return "2";
    case scene::EnvironmentType::Constant:
      break;
  }
  return "0";
}

bool hasSky(const frame::Lighting& lighting) {
  if (lighting.ambient != Vec3(0.0f)) return true;
  if (!lighting.environment) return false;
  const auto& sh = lighting.environment->irradianceSh();
  return std::any_of(sh.begin(), sh.end(), [](const Vec3& c) { return c != Vec3(0.0f); });
}

void FrameResources::bind(const FrameView& view, const frame::Lighting& lighting) {
  Block block{};
  block.clipFromWorld = view.clipFromWorld;
  block.rayFromWindow = view.rayFromWindow;
  block.eye = Vec4(view.eye, view.spreadRad);
  block.ambient = Vec4(lighting.ambient, view.radianceLimit);
  if (lighting.environment) {
    const scene::Environment& e = lighting.environment->description();
    block.environment[0] = Vec4(e.scale * e.color, 0.0f);
    block.environment[1] = Vec4(e.scale * e.horizon, 0.0f);
    block.environment[2] = Vec4(e.scale * e.ground, 0.0f);
    block.environmentTurn = Vec4(std::cos(e.rotationRad), std::sin(e.rotationRad), e.scale, 0.0f);
    for (int k = 0; k < 9; ++k) {
      block.irradianceSh[k] = Vec4(kHarmonics[k] * lighting.environment->irradianceSh()[k], 0.0f);
    }
  }
  block.environment[0].w = view.frontSign;

  std::vector<std::byte> bytes(sizeof(Block) + sizeof(LightBlock) * lighting.lights.size());
  std::memcpy(bytes.data(), &block, sizeof block);
  for (std::size_t i = 0; i < lighting.lights.size(); ++i) {
    const frame::WorldLight& light = lighting.lights[i];
    const LightBlock packed{
        Vec4(light.position, light.range > 0.0f ? 1.0f / light.range : 0.0f),
        Vec4(light.direction, light.cosOuter),
        Vec4(light.intensity, 1.0f / std::max(1e-3f, light.cosInner - light.cosOuter))};
    std::memcpy(bytes.data() + sizeof(Block) + i * sizeof(LightBlock), &packed, sizeof packed);
  }
  if (block_.size() != bytes.size()) {
    block_ = gl::Buffer("frame block", bytes.size(), bytes.data());
  } else {
    block_.write(0, bytes.size(), bytes.data());
  }
  block_.bindUniform(shared::kFrameBlock);
}

void FrameResources::bindEnvironment(const frame::Lighting& lighting) {
  if (environmentType(lighting) != "2") return;
  const frame::EnvironmentLight& environment = *lighting.environment;
  if (imageOf_ != &environment) {
    std::vector<Vec4> pixels;
    pixels.reserve(environment.pixels().size());
    for (const Vec3& pixel : environment.pixels()) pixels.emplace_back(pixel, 1.0f);
    image_ =
        gl::Texture::make2D("environment", GL_RGBA32F, environment.width(), environment.height());
    image_.upload(0, 0, GL_RGBA, GL_FLOAT, pixels.data());
    image_.setFilter(GL_LINEAR, GL_LINEAR);
    image_.setWrap(GL_REPEAT, GL_CLAMP_TO_EDGE);
    imageOf_ = &environment;
  }
  image_.bind(shared::kEnvironmentUnit);
}

}  // namespace catoptric::raster
