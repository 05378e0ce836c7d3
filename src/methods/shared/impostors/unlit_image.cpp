#include "methods/shared/impostors/unlit_image.h"

#include <algorithm>
#include <cmath>

#include "core/minmax.h"
#include "frame/harmonics.h"
#include "methods/shared/impostors/half_float.h"

// Loops over texels are plain ones that the compiler turns into vector code, once for each level of
// the machine; all give the same bits.
namespace catoptric::methods::impostors {
namespace {

constexpr std::size_t kTexels = 256;       ///< of a row that are lit at once; ours
constexpr float kMostRadiance = 65504.0f;  ///< of half floats
using Values = std::array<float, kTexels>;

/// Texels of a row: place and normal in world space, irradiance.
struct Lit {
  std::size_t count = 0;
  alignas(64) Values x, y, z;
  alignas(64) Values nx, ny, nz;
  alignas(64) Values red, green, blue;
};

CATOPTRIC_INLINE float between0And1(float a) {
  return smaller(larger(a, 0.0f), 1.0f);
}

/// Irradiance of the environment and ambient light, times visibility.
CATOPTRIC_INLINE void addSky(const std::array<Vec3, 9>& sh, const Vec3& ambient,
                             const Values& visibility, Lit& lit) {
  const auto one = [&](int channel, Values& into) {
    std::array<float, 9> c;
    for (std::size_t k = 0; k < c.size(); ++k)
      c[k] = static_cast<float>(frame::kHarmonics[k]) * sh[k][channel];
    const auto [c0, c1, c2, c3, c4, c5, c6, c7, c8] = c;
    const float always = kPi * ambient[channel];
    CATOPTRIC_INDEPENDENT
    for (std::size_t i = 0; i < lit.count; ++i) {
      const float x = lit.nx[i], y = lit.ny[i], z = lit.nz[i];
      const float e = c0 + c1 * y + c2 * z + c3 * x + c4 * (x * y) + c5 * (y * z) +
                      c6 * (3.0f * z * z - 1.0f) + c7 * (x * z) + c8 * (x * x - y * y);
      into[i] = visibility[i] * (larger(e, 0.0f) + always);
    }
  };
  one(0, lit.red);
  one(1, lit.green);
  one(2, lit.blue);
}

/// As frame::lightIrradiance().
CATOPTRIC_INLINE void addLight(const frame::WorldLight& light, Lit& lit) {
  const Vec3 at = light.position, along = light.direction, intensity = light.intensity;
  if (light.type == scene::LightType::Directional) {
    CATOPTRIC_INDEPENDENT
    for (std::size_t i = 0; i < lit.count; ++i) {
      const float factor =
          larger(0.0f, -(lit.nx[i] * along.x + lit.ny[i] * along.y + lit.nz[i] * along.z));
      lit.red[i] += intensity.x * factor;
      lit.green[i] += intensity.y * factor;
      lit.blue[i] += intensity.z * factor;
    }
    return;
  }
  const float perRange = light.range > 0.0f ? 1.0f / light.range : 0.0f;
  const float perCone = 1.0f / std::max(1e-3f, light.cosInner - light.cosOuter);
  // A cone that holds all directions, unless the light is a spot
  const bool spot = light.type == scene::LightType::Spot;
  const float outer = spot ? light.cosOuter : -2.0f;
  const float steep = spot ? perCone : 1e6f;
  CATOPTRIC_INDEPENDENT
  for (std::size_t i = 0; i < lit.count; ++i) {
    const float x = at.x - lit.x[i], y = at.y - lit.y[i], z = at.z - lit.z[i];
    const float r2 = x * x + y * y + z * z;
    const float inverse = 1.0f / std::sqrt(larger(r2, 1e-20f));
    const float cosine = larger(0.0f, (lit.nx[i] * x + lit.ny[i] * y + lit.nz[i] * z) * inverse);
    const float q = r2 * perRange * perRange;
    const float cone =
        between0And1((-(x * along.x + y * along.y + z * along.z) * inverse - outer) * steep);
    const float factor = cosine / larger(r2, 1e-12f) * between0And1(1.0f - q * q) * (cone * cone);
    lit.red[i] += smaller(intensity.x * factor, 1e30f);
    lit.green[i] += smaller(intensity.y * factor, 1e30f);
    lit.blue[i] += smaller(intensity.z * factor, 1e30f);
  }
}

}  // namespace

struct LitRow {
  const UnlitImage& image;
  const Camera& camera;
  const frame::Lighting& lighting;
  Mat3 turn;  ///< from the image's camera to `camera`

  const std::uint16_t* plane(int number, std::size_t first) const {
    return image.planes_[static_cast<std::size_t>(number)].data() + first;
  }

  const std::uint16_t* visibility(std::size_t first) const {
    return plane(UnlitImage::kVisibility, first);
  }

  /// Places and normals of `lit.count` texels of row `y` from `x` on.
  CATOPTRIC_INLINE void place(std::size_t x, std::size_t y, std::size_t first, Lit& lit) const {
    const float nearMetres = camera.nearMetres, farMetres = camera.farMetres;
    const float k = nearMetres / (farMetres - nearMetres);
    const auto size = static_cast<float>(image.size_);
    const Vec3 row =
        camera.forward +
        (camera.least.y + camera.size.y * (static_cast<float>(y) + 0.5f) / size) * camera.down;
    const Vec3 right = camera.right, eye = camera.eye;
    const float start = camera.least.x, step = camera.size.x / size;
    const float* const depth = image.depths_.data() + first;
    CATOPTRIC_INDEPENDENT
    for (std::size_t i = 0; i < lit.count; ++i) {
      const float across = start + step * (static_cast<float>(static_cast<int>(x + i)) + 0.5f);
      const float z = k * farMetres / (depth[i] + k);
      lit.x[i] = eye.x + z * (row.x + across * right.x);
      lit.y[i] = eye.y + z * (row.y + across * right.y);
      lit.z[i] = eye.z + z * (row.z + across * right.z);
    }
    const std::uint16_t* const nx = plane(UnlitImage::kNormal, first);
    const std::uint16_t* const ny = plane(UnlitImage::kNormal + 1, first);
    const std::uint16_t* const nz = plane(UnlitImage::kNormal + 2, first);
    const Vec3 a = turn[0], b = turn[1], c = turn[2];
    CATOPTRIC_INDEPENDENT
    for (std::size_t i = 0; i < lit.count; ++i) {
      const float u = floatOf(nx[i]), v = floatOf(ny[i]), w = floatOf(nz[i]);
      lit.nx[i] = a.x * u + b.x * v + c.x * w;
      lit.ny[i] = a.y * u + b.y * v + c.y * w;
      lit.nz[i] = a.z * u + b.z * v + c.z * w;
    }
  }

  CATOPTRIC_INLINE void write(std::size_t first, const Lit& lit, std::uint16_t* into) const {
    const float* const depth = image.depths_.data() + first;
    const auto one = [&](int channel, const Values& irradiance) {
      const std::uint16_t* const constant = plane(UnlitImage::kConstant + channel, first);
      const std::uint16_t* const albedo = plane(UnlitImage::kAlbedo + channel, first);
      CATOPTRIC_INDEPENDENT
      for (std::size_t i = 0; i < lit.count; ++i) {
        const float radiance = floatOf(constant[i]) + floatOf(albedo[i]) * irradiance[i];
        const std::uint16_t half = nearestHalf(smaller(radiance, kMostRadiance));
        into[4 * i + static_cast<std::size_t>(channel)] = depth[i] > 0.0f ? half : std::uint16_t{0};
      }
    };
    one(0, lit.red);
    one(1, lit.green);
    one(2, lit.blue);
    for (std::size_t i = 0; i < lit.count; ++i) into[4 * i + 3] = depth[i] > 0.0f ? 0x3C00 : 0;
  }
};

namespace {

CATOPTRIC_INLINE void lightBody(const LitRow& row, std::size_t size, std::uint16_t* into) {
  alignas(64) static thread_local Lit lit;
  alignas(64) static thread_local Values visibility;
  static const std::array<Vec3, 9> none{};
  const frame::Lighting& lighting = row.lighting;
  const std::array<Vec3, 9>& sh =
      lighting.environment ? lighting.environment->irradianceSh() : none;
  for (std::size_t y = 0; y < size; ++y) {
    for (std::size_t x = 0; x < size; x += kTexels) {
      const std::size_t first = y * size + x;
      lit.count = std::min(kTexels, size - x);
      row.place(x, y, first, lit);
      const std::uint16_t* const visible = row.visibility(first);
      CATOPTRIC_INDEPENDENT
      for (std::size_t i = 0; i < lit.count; ++i) visibility[i] = floatOf(visible[i]);
      addSky(sh, lighting.ambient, visibility, lit);
      for (const frame::WorldLight& light : lighting.lights) addLight(light, lit);
      row.write(first, lit, into + 4 * first);
    }
  }
}

}  // namespace

std::uint64_t UnlitImage::bytesOf(int size) {
  const auto texels = static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size);
  return texels * (kPlanes * sizeof(std::uint16_t) + sizeof(float));
}

void UnlitImage::set(int size, const Camera& camera, std::span<const std::uint16_t> constant,
                     std::span<const std::uint16_t> normals, std::span<const std::uint16_t> factors,
                     std::span<const float> depths) {
  size_ = size;
  axes_ = Mat3(camera.right, camera.down, camera.forward);
  depths_.assign(depths.begin(), depths.end());
  const auto take = [&](std::span<const std::uint16_t> from, int first, int count) {
    for (int c = 0; c < count; ++c) {
      std::vector<std::uint16_t>& plane = planes_[static_cast<std::size_t>(first + c)];
      plane.resize(depths.size());
      for (std::size_t i = 0; i < plane.size(); ++i)
        plane[i] = from[4 * i + static_cast<std::size_t>(c)];
    }
  };
  take(constant, kConstant, 3);
  take(factors, kAlbedo, 4);
  take(normals, kNormal, 3);
}

void UnlitImage::light(const Camera& camera, const frame::Lighting& lighting,
                       std::vector<std::uint16_t>& radiance) const {
  const auto size = static_cast<std::size_t>(size_);
  radiance.resize(4 * size * size);
  const Mat3 turn = Mat3(camera.right, camera.down, camera.forward) * glm::transpose(axes_);
  const LitRow row{*this, camera, lighting, turn};
  atVectorLevel<lightBody>(row, size, radiance.data());
}

}  // namespace catoptric::methods::impostors
