#include "run/stage/motion_layer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace catoptric::run {
namespace {

/// A wall of one object, 4 metres in front of a camera at the origin that looks along -z.
class MotionLayer : public testing::Test {
 protected:
  static constexpr int kWidth = 8;
  static constexpr int kHeight = 6;
  static constexpr int kSamples = 2;
  static constexpr float kDistance = 4.0f;

  MotionLayer() {
    geometry_.objects.resize(1);
    earlier_ = {camera_, {Mat4(1.0f)}};
  }
  /// The layer at a pixel.
  Vec3 at(int x, int y) const {
    const std::vector<float> depth(kWidth * kHeight * kSamples * kSamples,
                                   camera_.nearMetres / kDistance);
    const std::vector<std::uint32_t> object(depth.size(), object_);
    return motionLayer({depth, object, kWidth, kHeight, kSamples}, camera_, geometry_,
                       earlier_)[static_cast<std::size_t>(y * kWidth + x)];
  }
  /// Pixels per metre on the wall.
  float scale() const {
    return 0.5f * kHeight / (kDistance * std::tan(0.5f * camera_.verticalFovRad));
  }

  scene::Camera camera_;
  frame::Geometry geometry_;
  EarlierView earlier_;
  std::uint32_t object_ = 1;
};

TEST_F(MotionLayer, WhatStandsStillDoesNotMove) {
  EXPECT_NEAR(glm::length(at(5, 2) - Vec3(0.0f, 0.0f, kDistance)), 0.0f, 1e-5f);
}

TEST_F(MotionLayer, ACameraThatWentUpMovesTheWallDown) {
  earlier_.camera.worldFromCamera[3] = Vec4(0.0f, -0.5f, 0.0f, 1.0f);
  for (const auto& [x, y] : {std::pair(0, 0), {5, 2}, {7, 5}})
    EXPECT_NEAR(glm::length(at(x, y) - Vec3(0.0f, 0.5f * scale(), kDistance)), 0.0f, 1e-4f);
}

TEST_F(MotionLayer, AnObjectThatWentRightAndNearer) {
  geometry_.objects[0].worldFromObject = glm::translate(Mat4(1.0f), Vec3(0.25f, 0.0f, 1.0f));
  // A point of the wall at (X, Y, -4) was at (X - 0.25, Y, -5)
  const Vec3 moved = at(6, 1);
  const float x = (6.75f - 4.0f) / scale();
  const float y = -(1.75f - 3.0f) / scale();
  EXPECT_NEAR(moved.x, 6.75f - (4.0f + (x - 0.25f) * scale() * 4.0f / 5.0f), 1e-4f);
  EXPECT_NEAR(moved.y, 1.75f - (3.0f - y * scale() * 4.0f / 5.0f), 1e-4f);
  EXPECT_NEAR(moved.z, 5.0f, 1e-5f);
}

TEST_F(MotionLayer, UnknownPlacesAreZero) {
  geometry_.objects[0].deforms = true;
  EXPECT_EQ(at(3, 3), Vec3(0.0f));
  geometry_.objects[0].deforms = false;
  object_ = 0;  // background
  EXPECT_EQ(at(3, 3), Vec3(0.0f));
  object_ = 1;
  earlier_.camera.worldFromCamera[3] = Vec4(0.0f, 0.0f, -9.0f, 1.0f);  // beyond the wall
  EXPECT_EQ(at(3, 3), Vec3(0.0f));
  earlier_.camera = camera_;
  geometry_.objects[0].worldFromObject = glm::scale(Mat4(1.0f), Vec3(0.0f));
  EXPECT_EQ(at(3, 3), Vec3(0.0f));
}

}  // namespace
}  // namespace catoptric::run
