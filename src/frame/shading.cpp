#include "frame/shading.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/lanes.h"
#include "core/log.h"
#include "core/random.h"
#include "core/sampling.h"
#include "core/srgb.h"
#include "frame/harmonics.h"
#include "frame/texture_lookup.h"
#include "image/image.h"
#include "scene/loader.h"
#include "scene/reflectance.h"

namespace catoptric::frame {
namespace {

/// Sums radiance times the harmonics over directions with solid angles, then convolves with the
/// clamped cosine: A_0 = pi, A_1 = 2 pi / 3, A_2 = pi / 4 [Ramamoorthi2001].
class Projection {
 public:
  void add(double x, double y, double z, double solidAngle, const Vec3& radiance) {
    const std::array<double, 9> basis = sphericalHarmonics<double>(x, y, z);
    for (int k = 0; k < 9; ++k) sums_[k] += basis[k] * solidAngle * glm::dvec3(radiance);
  }
  std::array<Vec3, 9> irradiance() const {
    constexpr double kPiD = std::numbers::pi;
    std::array<Vec3, 9> result;
    for (int k = 0; k < 9; ++k) {
      const double a = k == 0 ? kPiD : (k < 4 ? 2.0 * kPiD / 3.0 : kPiD / 4.0);
      result[k] = Vec3(a * sums_[k]);
    }
    return result;
  }

 private:
  std::array<glm::dvec3, 9> sums_{};
};

/// Nodes and weights of 8-point Gauss-Legendre quadrature on (-1, 1): exact to degree 15.
constexpr std::array<std::array<double, 2>, 4> kGauss8 = {{
    {0.1834346424956498, 0.3626837833783620},
    {0.5255324099163290, 0.3137066458778873},
    {0.7966664774136267, 0.2223810344533745},
    {0.9602898564975363, 0.1012285362903763},
}};
constexpr int kAzimuths = 16;  ///< exact for the harmonics of order <= 2 times a constant

/// Throws SceneError for a pixel of an environment's image that is no radiance.
void requireRadiance(const scene::Environment& environment, const Vec3& pixel, int x, int y) {
  const auto fail = [&](const std::string& what) {
    throw SceneError(environment.file.string() + ": pixel (" + std::to_string(x) + ", " +
                     std::to_string(y) + ") is " + what);
  };
  if (!isFinite(pixel)) fail("not finite");
  if (!glm::all(glm::lessThanEqual(environment.scale * pixel, Vec3(scene::kMaxRadiance))))
    fail("too bright; with its scale a radiance up to 1e33 is allowed");
}

}  // namespace

EnvironmentLight::EnvironmentLight(const scene::Environment& environment)
    : description_(environment) {
  if (environment.type == scene::EnvironmentType::File) {
    const image::Image image = image::readImage(environment.file);
    const int r = image.channel("R");
    const int g = image.channel("G");
    const int b = image.channel("B");
    if (r < 0 || g < 0 || b < 0 || image.width < 1 || image.height < 1) {
      throw SceneError(environment.file.string() +
                       ": an environment image needs the channels R, G and B");
    }
    width_ = image.width;
    height_ = image.height;
    if (width_ != 2 * height_)
      log::warning(environment.file.string() + ": is " + std::to_string(width_) + " x " +
                   std::to_string(height_) +
                   " pixels; a latitude-longitude map is twice as wide as high. Is it one?");
    pixels_.resize(image.pixelCount());
    int negative = 0;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const Vec3 pixel(image.at(x, y, r), image.at(x, y, g), image.at(x, y, b));
        requireRadiance(environment, pixel, x, y);
        negative += glm::any(glm::lessThan(pixel, Vec3(0.0f))) ? 1 : 0;
        pixels_[static_cast<std::size_t>(y) * width_ + x] = glm::max(pixel, Vec3(0.0f));
      }
    }
    if (negative > 0)
      log::warning(environment.file.string() + ": negative radiance of " +
                   std::to_string(negative) + " pixels counts as 0; lossy compression leaves such");
  }

  Projection projection;
  if (environment.type == scene::EnvironmentType::File) {
    // Every pixel with its exact solid angle, in the file's frame turned into the world.
    const double cosR = std::cos(static_cast<double>(environment.rotationRad));
    const double sinR = std::sin(static_cast<double>(environment.rotationRad));
    for (int row = 0; row < height_; ++row) {
      const double theta0 = std::numbers::pi * row / height_;
      const double theta1 = std::numbers::pi * (row + 1) / height_;
      const double solidAngle =
          2.0 * std::numbers::pi / width_ * (std::cos(theta0) - std::cos(theta1));
      const double theta = 0.5 * (theta0 + theta1);
      for (int column = 0; column < width_; ++column) {
        const double phi = 2.0 * std::numbers::pi * ((column + 0.5) / width_ - 0.5);
        const double x = std::sin(theta) * std::sin(phi);
        const double z = -std::sin(theta) * std::cos(phi);
        projection.add(
            cosR * x + sinR * z, std::cos(theta), -sinR * x + cosR * z, solidAngle,
            environment.scale * pixels_[static_cast<std::size_t>(row) * width_ + column]);
      }
    }
  } else {
    // Constant and gradient are linear in y on each hemisphere: Gauss nodes make it exact.
    for (int hemisphere = -1; hemisphere <= 1; hemisphere += 2) {
      for (const auto& [node, weight] : kGauss8) {
        for (int sign = -1; sign <= 1; sign += 2) {
          const double y = hemisphere * 0.5 * (1.0 + sign * node);
          const double radius = std::sqrt(1.0 - y * y);
          for (int i = 0; i < kAzimuths; ++i) {
            const double phi = 2.0 * std::numbers::pi * i / kAzimuths;
            const double x = radius * std::cos(phi);
            const double z = radius * std::sin(phi);
            projection.add(x, y, z, 0.5 * weight * 2.0 * std::numbers::pi / kAzimuths,
                           radiance(Vec3(static_cast<float>(x), static_cast<float>(y),
                                         static_cast<float>(z))));
          }
        }
      }
    }
  }
  irradianceSh_ = projection.irradiance();
  for (std::size_t k = 0; k < 9; ++k) ofFour_[k] = Vec4(irradianceSh_[k], 0.0f);
}

Vec2 EnvironmentLight::imageUv(const Vec3& direction) const {
  // The direction turned by -rotation into the file's frame
  const float c = std::cos(description_.rotationRad);
  const float s = std::sin(description_.rotationRad);
  const float x = c * direction.x - s * direction.z;
  const float z = s * direction.x + c * direction.z;
  return {0.5f + std::atan2(x, -z) / (2.0f * kPi),
          std::acos(std::clamp(direction.y, -1.0f, 1.0f)) / kPi};
}

Vec3 EnvironmentLight::radiance(const Vec3& direction) const {
  const scene::Environment& e = description_;
  if (e.type == scene::EnvironmentType::Constant) return e.scale * e.color;
  if (e.type == scene::EnvironmentType::Gradient) {
    const float t = std::min(1.0f, std::abs(direction.y));
    return e.scale * glm::mix(e.horizon, direction.y >= 0.0f ? e.color : e.ground, t);
  }
  const Vec2 uv = imageUv(direction);
  const float px = uv.x * static_cast<float>(width_) - 0.5f;
  const float py = uv.y * static_cast<float>(height_) - 0.5f;
  const float fx = std::floor(px);
  const float fy = std::floor(py);
  const int column = std::max(static_cast<int>(fx), -1);  // not below for a NaN, either
  const int x0 = wrapped(column, width_, scene::Wrap::Repeat);
  const int x1 = wrapped(column + 1, width_, scene::Wrap::Repeat);
  const int y0 = wrapped(static_cast<int>(fy), height_, scene::Wrap::ClampToEdge);
  const int y1 = wrapped(static_cast<int>(fy) + 1, height_, scene::Wrap::ClampToEdge);
  const auto at = [&](int x, int y) { return pixels_[static_cast<std::size_t>(y) * width_ + x]; };
  return e.scale * glm::mix(glm::mix(at(x0, y0), at(x1, y0), px - fx),
                            glm::mix(at(x0, y1), at(x1, y1), px - fx), py - fy);
}

Vec3 EnvironmentLight::irradiance(const Vec3& normal) const {
  const std::array<float, 9> basis = sphericalHarmonics<float>(normal.x, normal.y, normal.z);
  Floats4 sum{};
  for (std::size_t k = 0; k < 9; ++k) sum += basis[k] * load<Floats4>(&ofFour_[k]);
  sum = most(Floats4{}, sum);
  return {sum[0], sum[1], sum[2]};
}

namespace {

/// A light that the bake holds is not evaluated again.
bool isBaked(const scene::Scene& scene, const scene::Light& light) {
  return light.baked && scene.bake.mode == scene::BakeMode::Full;
}

}  // namespace

bool hasUnbakedLights(const scene::Scene& scene) {
  return std::ranges::any_of(scene.lights,
                             [&](const scene::Light& light) { return !isBaked(scene, light); });
}

Lighting makeLighting(const scene::Scene& scene, const scene::Pose& pose,
                      std::shared_ptr<const EnvironmentLight> environment) {
  Lighting lighting;
  lighting.environment = std::move(environment);
  lighting.ambient = scene.ambient;
  lighting.highlights = scene.highlights;
  for (const scene::Light& light : scene.lights) {
    if (isBaked(scene, light)) continue;
    lighting.lights.push_back(worldLight(light, pose));
  }
  return lighting;
}

WorldLight worldLight(const scene::Light& light, const scene::Pose& pose) {
  WorldLight world;
  world.type = light.type;
  world.intensity = light.intensity;
  world.range = light.range;
  world.cosInner = std::cos(light.innerConeRad);
  world.cosOuter = std::cos(light.outerConeRad);
  world.position = light.position;
  world.direction = normalizedOr(light.direction, Vec3(0.0f, -1.0f, 0.0f));
  if (light.node != scene::kNone) {
    const Mat4& worldFromNode = pose.worldFromNode[light.node];
    world.position = Vec3(worldFromNode[3]);
    world.direction = normalizedOr(-Vec3(worldFromNode[2]), Vec3(0.0f, -1.0f, 0.0f));
  }
  return world;
}

Vec3 lightIrradiance(const WorldLight& light, const Vec3& position, const Vec3& normal) {
  if (light.type == scene::LightType::Directional) {
    return light.intensity * std::max(0.0f, glm::dot(normal, -light.direction));
  }
  const Vec3 toLight = light.position - position;
  const float distanceSquared = glm::dot(toLight, toLight);
  const float distance = std::sqrt(distanceSquared);
  if (!(distance > 0.0f)) return Vec3(0.0f);
  const Vec3 l = toLight / distance;
  float factor = std::max(0.0f, glm::dot(normal, l)) / std::max(distanceSquared, 1e-12f);
  if (light.range > 0.0f) {
    const float q = distance / light.range;
    factor *= std::clamp(1.0f - q * q * q * q, 0.0f, 1.0f);
  }
  if (light.type == scene::LightType::Spot) {
    const float cosine = glm::dot(-l, light.direction);
    const float cone = std::clamp(
        (cosine - light.cosOuter) / std::max(1e-3f, light.cosInner - light.cosOuter), 0.0f, 1.0f);
    factor *= cone * cone;
  }
  return glm::min(light.intensity * factor, Vec3(1e30f));
}

namespace {

/// (k + 1) / (2 pi) c^k of the cosine between two directions; in powers of its sine's square, as
/// large exponents ask for more than the cosine's digits.
float lobeDensity(const Vec3& mirror, const Vec3& l, float exponent) {
  const float cosine = glm::dot(mirror, l);
  if (!(cosine > 0.0f)) return 0.0f;
  const Vec3 across = glm::cross(mirror, l);
  const float q = std::min(glm::dot(across, across), 1.0f);
  const float series = -0.5f * q * (1.0f + q * (0.5f + q * (1.0f / 3.0f + q * (0.25f + q * 0.2f))));
  const float logarithm = q < 0.1f ? series : std::log(std::max(cosine, 1e-20f));
  return (exponent + 1.0f) / (2.0f * kPi) * std::exp(exponent * logarithm);
}

}  // namespace

Vec3 lightHighlights(const std::vector<WorldLight>& lights, const Vec3& position,
                     const Vec3& normal, const Vec3& lobeHorizon, const Vec3& direction,
                     scene::Lobe lobe) {
  const Vec3 mirror = glm::normalize(glm::reflect(direction, normal));
  const float exponent = lobe.ggx() ? 0.0f : scene::phongExponentFromRoughness(lobe.code);
  const scene::GgxView view = scene::ggxView(lobe.alpha(), -glm::dot(normal, direction));
  Vec3 sum(0.0f);
  for (const WorldLight& light : lights) {
    const Vec3 l = light.type == scene::LightType::Directional
                       ? -light.direction
                       : normalizedOr(light.position - position, normal);
    const float above = glm::dot(l, lobeHorizon);
    if (!(above > 0.0f)) continue;
    const float density = lobe.ggx()
                              ? scene::ggxResponse(view, normal, -direction, l)
                              : lobeDensity(mirror, l, exponent) +
                                    lobeDensity(mirror, l - 2.0f * above * lobeHorizon, exponent);
    sum += lightIrradiance(light, position, l) * density;
  }
  return glm::min(sum, Vec3(1e30f));
}

float textureScale(const scene::Scene& scene, const scene::TextureSlot& slot) {
  if (!slot.used()) return 0.0f;
  const scene::Texture& texture = scene.textures[slot.texture];
  if (texture.levels.empty()) return 0.0f;
  const glm::mat3x2& m = slot.transform;
  const float area = std::abs(m[0][0] * m[1][1] - m[0][1] * m[1][0]);
  const int size = std::max(texture.levels[0].width, texture.levels[0].height);
  return static_cast<float>(size) * std::sqrt(area);
}

bool bendsNormals(const scene::Scene& scene, const ObjectRange& range, int object) {
  const scene::Material& material = scene.materials[scene.objects[object].material];
  if (!(material.specularLevel > 0.0f) || material.refraction > 0.0f) return false;
  return material.normalTexture.used() || (!scene.objects[object].planar && range.surface < 0);
}

bool aboveSurface(const Vec3& geometric, const Vec3& direction, Vec3& normal) {
  const float viewer = -glm::dot(geometric, direction);
  const float least = std::min(kElevationShare * viewer, kLeastElevation);
  if (!(glm::dot(geometric, glm::reflect(direction, normal)) < least)) return false;
  // The viewer along X, the part of the normal across the geometric one, and along that one
  const Vec3 across = normal - glm::dot(normal, geometric) * geometric;
  const float length2 = glm::dot(across, across);
  const float b = std::max(viewer, 0.0f);
  const Vec3 x = across / std::sqrt(std::max(length2, 1e-20f));
  const float a = -glm::dot(x, direction);
  const float r2 = a * a + b * b;
  if (!(length2 > 1e-12f) || !(r2 > 1e-20f)) {
    normal = geometric;
    return true;
  }
  const float t = std::max(least, 0.0f);
  const float q = std::sqrt(std::max(r2 - t * t, 0.0f));
  const float cosine2 = (b * t - a * q) / r2;
  const float sine2 = std::max(a * t + b * q, 0.0f) / r2;
  const float larger = std::sqrt(0.5f + 0.5f * std::min(std::abs(cosine2), 1.0f));
  const float smaller = 0.5f * sine2 / larger;
  normal = cosine2 < 0.0f ? larger * x + smaller * geometric : smaller * x + larger * geometric;
  normal = glm::normalize(normal);
  return true;
}

Vec2 scatterPlace(int x, int y) {
  const auto column = static_cast<std::uint32_t>(x);
  const auto row = static_cast<std::uint32_t>(y);
  return {unitFloat(column * kR2xBits + row * kR2yBits),
          unitFloat(column * kR2yBits + row * kR2xBits)};
}

Vec3 reflectionTint(const scene::Material& material, float metallic, const Vec3& albedo) {
  if (!material.tintVaries()) return material.reflectionTint;
  if (!material.metallicRoughnessTexture.used())
    return material.reflectionTint + material.albedoTint * albedo;
  const scene::TintShares shares = scene::tintShares(metallic, material.dielectricF0);
  return shares.plain + shares.metal * albedo;
}

Vec4 sampleTexture(const scene::Texture& texture, Vec2 uv, float lod) {
  TexturePlace place;
  placeLookUp(texture, uv, lod, place);
  const Floats4 values = lookUp(texture, place, linearOfSrgb8().data());
  return {values[0], values[1], values[2], values[3]};
}

}  // namespace catoptric::frame
