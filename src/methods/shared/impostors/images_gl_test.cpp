#include "methods/shared/impostors/images.h"

#include <gtest/gtest.h>

#include "frame/test_scenes.h"
#include "methods/testing/gl_harness.h"

namespace catoptric::methods::impostors {
namespace {

/// A ball, and images of it.
struct BallImages {
  BallImages() : stage(ball(), test::framesOf(16, 16, 1)) {
    images.prepare(8, {.depths = true, .inMemory = true, .onDevice = false});
  }

  static scene::Scene ball() {
    test::SceneBuilder builder;
    builder.add(scene::makeSphere(0.5f, 16, 8, scene::UvMode::Unit), builder.diffuse(Vec3(0.5f)));
    return builder.scene();
  }
  /// The ball, seen from a direction.
  Impostor seenAlong(const Vec3& forward, bool depth) const {
    return {.object = 0,
            .depth = depth,
            .camera = lookAtPoints(verticesOf(stage.moment.geometry, 0), Vec3(0.0f), forward,
                                   {0, 1, 0}, 1e-3f)};
  }
  /// Number of depth maps drawn.
  int update(const std::vector<Impostor>& impostors, const std::vector<int>& needed) {
    int maps = 0;
    Services services = stage.services();
    images.update(services, impostors, needed, 8, true,
                  [&](int, std::span<const float> texels) { maps += texels.empty() ? 0 : 1; });
    return maps;
  }

  test::GlStage stage;
  Images images;
};

TEST(Images, ABillboardIsNoDepthMapOfTheSameCamera) {
  BallImages ball;
  const std::vector<Impostor> both = {ball.seenAlong({0, 0, -1}, false),
                                      ball.seenAlong({0, 0, -1}, true)};
  EXPECT_EQ(ball.update(both, {0}), 0);
  EXPECT_EQ(ball.update(both, {1}), 1);
  EXPECT_EQ(ball.update(both, {0, 1}), 0);
  EXPECT_EQ(ball.images.reusedCount(), 2u);
}

TEST(Images, ImagesThatNoReflectorHasAnyMoreGiveWay) {
  BallImages ball;
  std::vector<Impostor> seen = {ball.seenAlong({0, 0, -1}, false)};
  for (int i = 0; i < 6; ++i) {
    seen.front().camera.eye.x += 0.1f;  // as of a reflector that moves
    ball.images.retain(seen);
    ball.update(seen, {0});
    EXPECT_EQ(ball.images.drawnCount(), 1u);
  }
  EXPECT_EQ(ball.images.layers(), 1u);
  ball.update(seen, {0});
  EXPECT_EQ(ball.images.drawnCount(), 0u);
  ball.images.limit(0);
  EXPECT_EQ(ball.images.layers(), 0u);
  ball.update(seen, {0});
  EXPECT_EQ(ball.images.drawnCount(), 1u);
}

}  // namespace
}  // namespace catoptric::methods::impostors
