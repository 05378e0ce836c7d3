#include "methods/shared/impostors/unfit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "frame/test_scenes.h"
#include "methods/testing/cpu_harness.h"

namespace catoptric::methods::impostors {
namespace {

/// Two long mirrors of width 1 that meet at an angle.
scene::Mesh wedge(float angleRad) {
  constexpr float kLength = 200.0f;
  scene::Mesh mesh;
  const Vec3 across[] = {{1.0f, 0.0f, 0.0f}, {std::cos(angleRad), std::sin(angleRad), 0.0f}};
  for (const Vec3& width : across) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3& corner : {Vec3(0.0f), width}) {
      mesh.positions.push_back(corner - Vec3(0.0f, 0.0f, 0.5f * kLength));
      mesh.positions.push_back(corner + Vec3(0.0f, 0.0f, 0.5f * kLength));
    }
    mesh.normals.resize(mesh.positions.size(), Vec3(-width.y, width.x, 0.0f));
    for (const std::uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u})
      mesh.indices.push_back(first + corner);
  }
  return mesh;
}

struct Mirror {
  explicit Mirror(scene::Mesh mesh) {
    builder.add(std::move(mesh), builder.reflective(1.0f),
                test::translation({7.0f, 1.0f, -2.0f}) * test::rotation(40.0f, {1.0f, 2.0f, 3.0f}));
    moment.emplace(builder.scene());
  }
  float share() const { return selfReflection(moment->scene, moment->geometry, 0); }
  Unfit unfit(const Options& options, float billboardErrors = 0.0f) const {
    Choice choice;
    choice.billboardErrors = {billboardErrors};
    return unfitReflectors(options, moment->scene, moment->geometry, choice, {true}).front();
  }

  test::SceneBuilder builder;
  std::optional<test::Moment> moment;
};

TEST(Unfit, AWedgeReflectsItselfByTheFormFactorOfItsMirrors) {
  for (const float degrees : {90.0f, 110.0f, 130.0f, 150.0f, 180.0f}) {
    // The share of a point's rays that hit the other mirror. None of their mirrored rays does, so
    // these lines of sight are all that reflect the wedge. The outer sides are seen from
    // everywhere.
    const float factor = 1.0f - std::sin(radians(0.5f * degrees));
    EXPECT_NEAR(Mirror(wedge(radians(degrees))).share(), factor / (2.0f - factor), 0.01f)
        << degrees;
  }
}

TEST(Unfit, NoReflectorBesideImplicitSurfacesIsUnfit) {
  Mirror narrow(wedge(radians(90.0f)));
  narrow.moment->geometry.surfaces.resize(1);
  EXPECT_EQ(narrow.unfit({}, 9.0f), Unfit::No);
}

TEST(Unfit, ConvexObjectsReflectNothingOfThemselves) {
  EXPECT_EQ(Mirror(scene::makeSphere(0.3f, 64, 32, scene::UvMode::Unit)).share(), 0.0f);
  EXPECT_EQ(Mirror(scene::makeBox({.size = Vec3(0.2f)}, scene::UvMode::Unit)).share(), 0.0f);
}

TEST(Unfit, IsWhatReflectsItselfOrIsNearOthers) {
  const Mirror narrow(wedge(radians(90.0f)));
  const Mirror wide(wedge(radians(130.0f)));
  EXPECT_EQ(narrow.unfit({}), Unfit::Itself);
  EXPECT_EQ(wide.unfit({}), Unfit::No);
  EXPECT_EQ(narrow.unfit({.selfMaps = 1}), Unfit::No);
  EXPECT_EQ(wide.unfit({}, 4.9f), Unfit::No);
  EXPECT_EQ(wide.unfit({}, 5.0f), Unfit::Near);
}

}  // namespace
}  // namespace catoptric::methods::impostors
