// GGX against sums over directions: what is sampled, its density, its energy and its fits.
#include "scene/lobe.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/sampling.h"

namespace catoptric::scene {
namespace {

constexpr int kSide = 192;  ///< of grids that are summed over

/// Calls body(direction, solid angle) for a grid over the upper hemisphere, dense about the normal.
template <class Body>
void overHemisphere(Body&& body) {
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < 2 * kSide; ++j) {
      // theta by t^2, so that sharp lobes have cells
      const double t = (i + 0.5) / kSide;
      const double theta = 0.5 * kPi * t * t;
      const double phi = kPi * (j + 0.5) / kSide;
      const double area = kPi * t / kSide * kPi / kSide * std::sin(theta);
      body(Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)),
           area);
    }
  }
}

Vec3 viewAt(float cosine) {
  return {std::sqrt(1.0f - cosine * cosine), 0.0f, cosine};
}

/// Calls body(ray) for low-discrepancy points of the disk.
template <class Body>
void overRays(const GgxView& view, int count, Body&& body) {
  for (int k = 0; k < count; ++k) {
    const float radius = std::sqrt((static_cast<float>(k) + 0.5f) / static_cast<float>(count));
    const float angle = 2.0f * kPi * radicalInverse2(static_cast<std::uint32_t>(k));
    body(ggxRay(view, radius * std::cos(angle), radius * std::sin(angle)));
  }
}

struct Case {
  float roughness, cosine;
};
constexpr Case kCases[] = {{0.25f, 1.0f}, {0.25f, 0.5f}, {0.5f, 0.9f}, {0.5f, 0.3f},
                           {0.8f, 0.7f},  {0.8f, 0.2f},  {1.0f, 0.6f}};

// White furnace: with Fresnel's factor 1 the mean weight is the albedo, which a sum over directions
// of the very response has too; single scattering loses the rest and gains nothing.
TEST(Ggx, FurnaceLosesWhatSingleScatteringLoses) {
  for (const auto& [roughness, cosine] : kCases) {
    const GgxView view = ggxView(roughness * roughness, cosine);
    double albedo = 0.0;
    overHemisphere([&](const Vec3& l, double area) {
      albedo += area * ggxResponse(view, Vec3(0.0f, 0.0f, 1.0f), viewAt(cosine), l);
    });
    double sampled = 0.0;
    overRays(view, 4096, [&](const GgxRay& ray) {
      EXPECT_LE(ray.weight, 1.0f);
      sampled += ray.weight / 4096.0;
    });
    EXPECT_NEAR(sampled, albedo, 0.01) << roughness << " " << cosine;
    EXPECT_LT(albedo, 1.005) << roughness << " " << cosine;
  }
}

// Radiance from one side of the sky alone arrives in the same share by rays and by the response.
TEST(Ggx, RaysAreDenseWhereTheLobeIs) {
  const Vec3 normal(0.0f, 0.0f, 1.0f);
  for (const auto& [roughness, cosine] : kCases) {
    const GgxView view = ggxView(roughness * roughness, cosine);
    for (const Vec3 side : {Vec3(-1.0f, 0.0f, 0.3f), Vec3(0.0f, 1.0f, 0.2f)}) {
      double summed = 0.0;
      overHemisphere([&](const Vec3& l, double area) {
        if (glm::dot(l, side) > 0.4f) summed += area * ggxResponse(view, normal, viewAt(cosine), l);
      });
      double sampled = 0.0;
      overRays(view, 8192, [&](const GgxRay& ray) {
        if (glm::dot(Vec3(ray.x, ray.y, ray.z), side) > 0.4f) sampled += ray.weight / 8192.0;
      });
      EXPECT_NEAR(sampled, summed, 0.012) << roughness << " " << cosine;
    }
  }
}

// weight * density is the response, and the density sums to 1 over all directions.
TEST(Ggx, DensityIsTheResponsePerWeight) {
  for (const auto& [roughness, cosine] : kCases) {
    const GgxView view = ggxView(roughness * roughness, cosine);
    overRays(view, 64, [&](const GgxRay& ray) {
      if (!(ray.weight > 1e-3f)) return;
      const float response = ggxResponse(view, Vec3(0.0f, 0.0f, 1.0f), viewAt(cosine),
                                         glm::normalize(Vec3(ray.x, ray.y, ray.z)));
      EXPECT_NEAR(ray.weight * ray.density / response, 1.0f, 2e-3f) << roughness << " " << cosine;
    });
  }
}

TEST(Ggx, IsReciprocal) {
  const Vec3 normal(0.0f, 0.0f, 1.0f);
  const Vec3 a = glm::normalize(Vec3(0.6f, 0.1f, 0.5f));
  const Vec3 b = glm::normalize(Vec3(-0.2f, -0.7f, 0.9f));
  for (const float roughness : {0.2f, 0.5f, 1.0f}) {
    const float alpha = roughness * roughness;
    // A response holds the cosine of the light: divided by it, views and lights may be exchanged
    EXPECT_NEAR(ggxResponse(ggxView(alpha, a.z), normal, a, b) / b.z,
                ggxResponse(ggxView(alpha, b.z), normal, b, a) / a.z, 1e-4f);
  }
}

TEST(Ggx, MeanSchlickIsThatOfTheRays) {
  double sum = 0.0;
  int count = 0;
  for (float roughness = 0.05f; roughness <= 1.0f; roughness += 0.05f) {
    for (float cosine = 0.05f; cosine <= 1.0f; cosine += 0.05f) {
      const GgxView view = ggxView(roughness * roughness, cosine);
      double weights = 0.0;
      double schlick = 0.0;
      overRays(view, 512, [&](const GgxRay& ray) {
        const Vec3 half = glm::normalize(viewAt(cosine) + Vec3(ray.x, ray.y, ray.z));
        const float c = 1.0f - glm::dot(half, viewAt(cosine));
        weights += ray.weight;
        schlick += ray.weight * c * c * c * c * c;
      });
      const double off = std::abs(schlick / weights - meanSchlick(roughness, cosine));
      EXPECT_LT(off, 0.035) << roughness << " " << cosine;
      sum += off;
      ++count;
    }
  }
  EXPECT_LT(sum / count, 0.007);
  EXPECT_NEAR(meanSchlick(0.0f, 0.5f), 1.0f / 32.0f, 1e-6f);
}

TEST(Ggx, HalfAngleHoldsItsShareOfTheLobe) {
  double sum = 0.0;
  int count = 0;
  for (float roughness = 0.1f; roughness <= 1.0f; roughness += 0.1f) {
    for (float cosine = 0.2f; cosine <= 1.0f; cosine += 0.1f) {
      const GgxView view = ggxView(roughness * roughness, cosine);
      const float angle = ggxHalfAngleRad(roughness * roughness, cosine);
      const Vec3 mirror(-viewAt(cosine).x, 0.0f, cosine);
      const auto shareWithin = [&](float wide) {
        double all = 0.0;
        double within = 0.0;
        overRays(view, 1024, [&](const GgxRay& ray) {
          all += ray.weight;
          const float away = glm::dot(glm::normalize(Vec3(ray.x, ray.y, ray.z)), mirror);
          if (away > std::cos(wide)) within += ray.weight;
        });
        return within / all;
      };
      // Off by 36 % at most, by the angle
      EXPECT_LT(shareWithin(angle / 1.36f), 0.633) << roughness << " " << cosine;
      EXPECT_GT(shareWithin(angle * 1.36f), 0.631) << roughness << " " << cosine;
      sum += std::abs(shareWithin(angle) - 0.632);
      ++count;
    }
  }
  EXPECT_LT(sum / count, 0.04);
}

TEST(Lobe, CodesTellModelsApart) {
  const Lobe phong = Lobe::of(LobeModel::Phong, 0.4f);
  const Lobe ggx = Lobe::of(LobeModel::Ggx, 0.4f);
  EXPECT_FALSE(phong.ggx());
  EXPECT_TRUE(ggx.ggx());
  EXPECT_NEAR(ggx.roughness(), phong.roughness(), 1e-6f);
  EXPECT_TRUE(Lobe::of(LobeModel::Phong, kMirrorPhongRoughness).mirror());
  EXPECT_FALSE(Lobe::of(LobeModel::Phong, kMirrorPhongRoughness + 1e-3f).mirror());
  EXPECT_TRUE(Lobe::of(LobeModel::Ggx, kMirrorGgxRoughness - 1e-3f).mirror());
  EXPECT_FALSE(Lobe::of(LobeModel::Ggx, kMirrorGgxRoughness + 1e-3f).mirror());
  // The two thresholds are of lobes equally wide
  EXPECT_NEAR(ggxHalfAngleRad(kMirrorGgxRoughness * kMirrorGgxRoughness, 1.0f),
              std::sqrt(2.0f / (phongExponentFromRoughness(kMirrorPhongRoughness) + 1.0f)), 3e-4f);
}

}  // namespace
}  // namespace catoptric::scene
