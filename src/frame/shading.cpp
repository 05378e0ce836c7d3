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
#include "image/image.h"
#include "scene/implicit/gradient.h"
#include "scene/loader.h"
#include "scene/reflectance.h"

namespace catoptric::frame {
namespace {

/// The nine real spherical harmonics of order <= 2, in the order of the agreement.
template <class T>
std::array<T, 9> sphericalHarmonics(T x, T y, T z) {
  return {T(0.282095),
          T(0.488603) * y,
          T(0.488603) * z,
          T(0.488603) * x,
          T(1.092548) * x * y,
          T(1.092548) * y * z,
          T(0.315392) * (T(3) * z * z - T(1)),
          T(1.092548) * x * z,
          T(0.546274) * (x * x - y * y)};
}

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

Vec4 texel(const scene::Texture& texture, const scene::MipLevel& level, int x, int y) {
  const std::uint8_t* p =
      &level.rgba[(static_cast<std::size_t>(y) * level.width + static_cast<std::size_t>(x)) * 4];
  const float alpha = static_cast<float>(p[3]) * (1.0f / 255.0f);
  if (texture.srgb) {
    const std::array<float, 256>& table = linearOfSrgb8();
    return {table[p[0]], table[p[1]], table[p[2]], alpha};
  }
  return {static_cast<float>(p[0]) * (1.0f / 255.0f), static_cast<float>(p[1]) * (1.0f / 255.0f),
          static_cast<float>(p[2]) * (1.0f / 255.0f), alpha};
}

int wrapped(int i, int size, scene::Wrap wrap) {
  switch (wrap) {
    case scene::Wrap::Repeat: {
      const int r = i % size;
      return r < 0 ? r + size : r;
    }
    case scene::Wrap::MirroredRepeat: {
      int r = i % (2 * size);
      if (r < 0) r += 2 * size;
      return r < size ? r : 2 * size - 1 - r;
    }
    case scene::Wrap::ClampToEdge:
      break;
  }
  return std::clamp(i, 0, size - 1);
}

/// uv brought near the base period, so that conversion to integers is defined for any finite uv.
float reduced(float u, scene::Wrap wrap) {
  if (!std::isfinite(u)) return 0.0f;
  if (wrap == scene::Wrap::ClampToEdge) return std::clamp(u, -1.0f, 2.0f);
  return u - 2.0f * std::floor(0.5f * u);
}

Vec4 bilinear(const scene::Texture& texture, const scene::MipLevel& level, Vec2 uv) {
  const float x = reduced(uv.x, texture.wrapS) * static_cast<float>(level.width) - 0.5f;
  const float y = reduced(uv.y, texture.wrapT) * static_cast<float>(level.height) - 0.5f;
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const int x0 = wrapped(static_cast<int>(fx), level.width, texture.wrapS);
  const int x1 = wrapped(static_cast<int>(fx) + 1, level.width, texture.wrapS);
  const int y0 = wrapped(static_cast<int>(fy), level.height, texture.wrapT);
  const int y1 = wrapped(static_cast<int>(fy) + 1, level.height, texture.wrapT);
  const Vec4 top = glm::mix(texel(texture, level, x0, y0), texel(texture, level, x1, y0), x - fx);
  const Vec4 bottom =
      glm::mix(texel(texture, level, x0, y1), texel(texture, level, x1, y1), x - fx);
  return glm::mix(top, bottom, y - fy);
}

/// The three vertices of a triangle with their weights.
struct Interpolation {
  const VertexAttributes* a;
  const VertexAttributes* b;
  const VertexAttributes* c;
  float wa, wb, wc;
  template <class T>
  T operator()(T VertexAttributes::*member) const {
    return wa * (a->*member) + wb * (b->*member) + wc * (c->*member);
  }
};

Interpolation interpolation(const Geometry& geometry, const std::uint32_t* triangle, float u,
                            float v) {
  return {&geometry.attributes[triangle[0]],
          &geometry.attributes[triangle[1]],
          &geometry.attributes[triangle[2]],
          1.0f - u - v,
          u,
          v};
}

Vec2 slotUv(const scene::TextureSlot& slot, const Interpolation& at) {
  const Vec2 uv = slot.uvSet == 1 ? at(&VertexAttributes::uv1) : at(&VertexAttributes::uv0);
  return slot.transform * Vec3(uv, 1.0f);
}

/// Throws SceneError for a pixel of an environment's image that is no radiance.
void requireRadiance(const scene::Environment& environment, const Vec3& pixel, int x, int y) {
  const auto fail = [&](const std::string& what) {
    throw SceneError(environment.file.string() + ": pixel (" + std::to_string(x) + ", " +
                     std::to_string(y) + ") is " + what);
  };
  if (!isFinite(pixel) || glm::any(glm::lessThan(pixel, Vec3(0.0f))))
    fail("negative or not finite; radiance must be >= 0");
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
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const Vec3 pixel(image.at(x, y, r), image.at(x, y, g), image.at(x, y, b));
        requireRadiance(environment, pixel, x, y);
        pixels_[static_cast<std::size_t>(y) * width_ + x] = pixel;
      }
    }
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
  const int x0 = wrapped(static_cast<int>(fx), width_, scene::Wrap::Repeat);
  const int x1 = wrapped(static_cast<int>(fx) + 1, width_, scene::Wrap::Repeat);
  const int y0 = wrapped(static_cast<int>(fy), height_, scene::Wrap::ClampToEdge);
  const int y1 = wrapped(static_cast<int>(fy) + 1, height_, scene::Wrap::ClampToEdge);
  const auto at = [&](int column, int row) {
    return pixels_[static_cast<std::size_t>(row) * width_ + column];
  };
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
  return Vec3(shares.plain) + shares.metal * albedo;
}

namespace {

/// A normal map's texel in the frame of the interpolated normal and tangent.
Vec3 mappedNormal(const scene::Material& material, const Vec3& smooth, const Vec4& tangent,
                  const Vec3& texel) {
  const Vec3 t = normalizedOr(Vec3(tangent), Vec3(1.0f, 0.0f, 0.0f));
  const Vec3 b = glm::cross(smooth, t) * tangent.w;
  Vec3 m = 2.0f * texel - Vec3(1.0f);
  m.x *= material.normalScale;
  m.y *= material.normalScale;
  return normalizedOr(m.x * t + m.y * b + m.z * smooth, smooth);
}

/// A texel of the footprint of level `lod`, from a finer level.
Vec4 scatteredTexel(const scene::Texture& texture, const Vec2& uv, float lod, const Vec2& scatter) {
  const bool levelled = !texture.nearest && !texture.levels.empty();
  const float last = levelled ? static_cast<float>(texture.levels.size() - 1) : 0.0f;
  const float level = std::clamp(lod, 0.0f, last);
  if (!(level > 0.0f)) return sampleTexture(texture, uv, 0.0f);
  const Vec2 size(texture.levels[0].width, texture.levels[0].height);
  const Vec2 offset = (scatter - 0.5f) * (std::exp2(level) - 1.0f) / size;
  return sampleTexture(texture, uv + offset, std::max(level - kFinerLevels, 0.0f));
}

/// s, the lobe and the tint. `texel`: of the metallic-roughness texture.
void setReflection(const scene::Material& material, const Vec4& texel, const Vec3& albedo,
                   SurfacePoint& point) {
  point.specularLevel = material.specularLevel;
  float roughness = material.roughness;
  float metallic = material.metallicFactor;
  if (material.metallicRoughnessTexture.used()) {
    roughness = material.roughnessFactor * texel.g;
    metallic *= texel.b;
    const float s = scene::specularLevel(metallic, material.dielectricF0);
    const bool phong = material.lobe == scene::LobeModel::Phong;
    point.specularLevel = phong && s < scene::kReflectiveThreshold ? 0.0f : s;
  }
  point.lobe = scene::Lobe::of(material.lobe, roughness);
  point.tint = reflectionTint(material, metallic, albedo);
}

/// Of what is baked, the sky and the lights.
Vec3 surfaceIrradiance(const Lighting& lighting, const Vec4& bake, const Vec3& position,
                       const Vec3& normal) {
  Vec3 irradiance = Vec3(bake);
  if (bake.w > 0.0f) {
    irradiance += bake.w * (lighting.environment->irradiance(normal) + kPi * lighting.ambient);
  }
  for (const WorldLight& light : lighting.lights) {
    irradiance += lightIrradiance(light, position, normal);
  }
  return irradiance;
}

}  // namespace

SurfacePoint shadeSurface(const scene::Scene& scene, const Geometry& geometry,
                          const Lighting& lighting, int object, std::uint32_t primitive, float u,
                          float v, const Vec3& position, const Vec3& direction, float coneWidth,
                          const std::optional<Vec2>& scatter) {
  const ObjectRange& range = geometry.objects[object];
  const std::uint32_t* triangle = &geometry.indices[range.firstIndex + 3 * primitive];
  const Interpolation at = interpolation(geometry, triangle, u, v);
  const scene::Material& material = scene.materials[scene.objects[object].material];

  // Geometric and interpolated normal, which side is seen.
  const Vec3& p0 = geometry.positions[triangle[0]];  // a copy would go by way of the stack
  const Vec3 across =
      glm::cross(geometry.positions[triangle[1]] - p0, geometry.positions[triangle[2]] - p0);
  Vec3 smooth = normalizedOr(at(&VertexAttributes::normal), Vec3(0.0f, 1.0f, 0.0f));
  Vec3 geometric = normalizedOr(across, smooth);
  if (range.surface >= 0) {
    // The gradient, but where there is none.
    const auto exact = implicit::normalAt(geometry.surfaces[range.surface].surface, position);
    if (exact) smooth = geometric = Vec3(*exact);
  }
  const bool back = glm::dot(geometric, direction) > 0.0f;

  // One mip level rule for all textures of the material.
  const float facing = std::sqrt(std::max(std::abs(glm::dot(smooth, direction)), 0.05f));
  const auto lodOf = [&](const scene::TextureSlot& slot) {
    const float footprint = range.uvPerMetre * textureScale(scene, slot) * coneWidth / facing;
    return std::log2(std::max(1e-8f, footprint));
  };
  const auto sample = [&](const scene::TextureSlot& slot) {
    return sampleTexture(scene.textures[slot.texture], slotUv(slot, at), lodOf(slot));
  };

  SurfacePoint point;
  point.object = object + 1;
  point.position = position;
  point.geometricNormal = back ? -geometric : geometric;

  const scene::TextureSlot& bumps = material.normalTexture;
  const auto mapped = [&](const Vec4& texel) {
    const Vec3 n = mappedNormal(material, smooth, at(&VertexAttributes::tangent), Vec3(texel));
    return back ? -n : n;
  };
  const Vec3 normal = bumps.used() ? mapped(sample(bumps)) : back ? -smooth : smooth;
  point.normal = normal;

  Vec3 albedo = material.baseColor;
  if (material.baseColorTexture.used()) albedo *= Vec3(sample(material.baseColorTexture));
  albedo *= at(&VertexAttributes::color);

  const scene::TextureSlot& slot = material.metallicRoughnessTexture;
  setReflection(material, slot.used() ? sample(slot) : Vec4(1.0f), albedo, point);
  if (scatter && point.specularLevel > 0.0f && bumps.used()) {
    point.normal = mapped(
        scatteredTexel(scene.textures[bumps.texture], slotUv(bumps, at), lodOf(bumps), *scatter));
  }
  const bool bends = point.specularLevel > 0.0f && bendsNormals(scene, range, object);
  if (bends) point.bent = aboveSurface(point.geometricNormal, direction, point.normal);
  point.lobeHorizon = bends && !point.lobe.mirror() ? point.geometricNormal : point.normal;
  const bool shines = lighting.highlights && material.refraction == 0.0f &&
                      point.specularLevel > 0.0f && !point.lobe.mirror();
  if (shines) {
    point.highlight = lightHighlights(lighting.lights, position, point.normal, point.lobeHorizon,
                                      direction, point.lobe);
  }

  // Diffuse radiance.
  if (material.unlit) {
    point.diffuse = albedo;
    return point;
  }
  const Vec3 irradiance =
      surfaceIrradiance(lighting, at(&VertexAttributes::bake), position, normal);
  Vec3 emissive = material.emissive;
  if (material.emissiveTexture.used()) emissive *= Vec3(sample(material.emissiveTexture));
  point.diffuse = albedo * (1.0f / kPi) * irradiance + emissive;
  return point;
}

bool isCutOut(const scene::Scene& scene, const Geometry& geometry, int object,
              std::uint32_t primitive, float u, float v) {
  const scene::Material& material = scene.materials[scene.objects[object].material];
  if (material.alphaMode != scene::AlphaMode::Mask) return false;
  float alpha = material.baseAlpha;
  if (material.baseColorTexture.used()) {
    const ObjectRange& range = geometry.objects[object];
    const Interpolation at =
        interpolation(geometry, &geometry.indices[range.firstIndex + 3 * primitive], u, v);
    alpha *= sampleTexture(scene.textures[material.baseColorTexture.texture],
                           slotUv(material.baseColorTexture, at), 0.0f)
                 .a;
  }
  return alpha < material.alphaCutoff;
}

Vec4 sampleTexture(const scene::Texture& texture, Vec2 uv, float lod) {
  if (texture.levels.empty()) return Vec4(1.0f);
  if (texture.nearest) {
    const scene::MipLevel& level = texture.levels[0];
    const float x = std::floor(reduced(uv.x, texture.wrapS) * static_cast<float>(level.width));
    const float y = std::floor(reduced(uv.y, texture.wrapT) * static_cast<float>(level.height));
    return texel(texture, level, wrapped(static_cast<int>(x), level.width, texture.wrapS),
                 wrapped(static_cast<int>(y), level.height, texture.wrapT));
  }
  const float last = static_cast<float>(texture.levels.size() - 1);
  const float clamped = lod > 0.0f ? std::min(lod, last) : 0.0f;
  const auto below = static_cast<std::size_t>(clamped);
  const float fraction = clamped - static_cast<float>(below);
  const Vec4 fine = bilinear(texture, texture.levels[below], uv);
  if (!(fraction > 0.0f)) return fine;
  return glm::mix(fine, bilinear(texture, texture.levels[below + 1], uv), fraction);
}

}  // namespace catoptric::frame
