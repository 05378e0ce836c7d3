#include <gtest/gtest.h>

#include "methods/second_order/depth_images/depth_images.h"
#include "methods/second_order/test_comparison.h"

namespace catoptric::methods::second_order {
namespace {

TEST(DepthImages, StayWithinTheirMemoryInFramesOfAnySize) {
  gl::testContext();
  constexpr std::uint64_t kBytes = 1u << 20;
  DepthImages images(8192, 8192, 2.0f, {.memoryBytes = kBytes});
  EXPECT_LE(12u * static_cast<std::uint64_t>(images.layerWidth()) *
                static_cast<std::uint64_t>(images.layerHeight()),
            kBytes);
  EXPECT_GT(images.layerWidth(), 250);
  const auto camera = [](int width, int height) {
    ClusterCamera made;
    made.width = width;
    made.height = height;
    return made;
  };
  EXPECT_TRUE(images.fits(std::vector{camera(200, 200), camera(50, 200)}));
  EXPECT_FALSE(images.fits(std::vector{camera(200, 200), camera(200, 200)}));  // a second layer
  EXPECT_FALSE(images.fits(std::vector{camera(400, 20)}));
}

TEST(SecondOrder, LittleMemoryMeansCoarseImages) {
  const auto frame = [](const char* options) {
    return Comparison(roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
                      cameraAt({0.4f, 0.8f, 2.0f}, {0.0f, 0.0f, 0.0f}), imagesAlone(options));
  };
  const Comparison plain = frame(R"({"depth_image_scale": 2})");
  const Comparison small = frame(R"({"depth_image_scale": 2, "memory_mib": 1})");
  EXPECT_GT(plain.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_LE(small.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_EQ(plain.output.counters.at("images_shrunk"), 0u);
  EXPECT_GT(small.output.counters.at("images_shrunk"), 0u);
  EXPECT_TRUE(small.finite);
  EXPECT_LT(small.meanDifference, 0.015);

  // A mirror whose grid is shrunk is looked up between texels
  const Comparison mirror(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.2f, 0.5f, 1.2f}, {0.0f, 0.0f, 0.0f}),
      R"({"memory_mib": 1, "depth_image_scale": 1.5})");
  EXPECT_LE(mirror.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_GT(mirror.output.counters.at("images_shrunk"), 0u);
  EXPECT_LT(mirror.meanDifference, 0.003);
}

TEST(SecondOrder, CompoundImagesAreAsGood) {
  for (const bool curved : {false, true}) {
    const auto frame = [&](const char* options) {
      return Comparison(
          roomWith(curved ? scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres)
                          : scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres),
                   Mat4(1.0f)),
          cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), options);
    };
    const Comparison plain = frame(R"({"compound": false})");
    const Comparison compound = frame("{}");
    EXPECT_NEAR(compound.meanDifference, plain.meanDifference, 2e-4);
    EXPECT_NEAR(compound.different, plain.different, 1e-3);
    EXPECT_EQ(compound.output.counters.at("triangles"), plain.output.counters.at("triangles"));
  }
}

TEST(SecondOrder, ASecondDepthLayerShowsWhatIsHidden) {
  // A ball that reflects posts close to it, in clusters so large that their cameras do not see what
  // some rays see behind the posts
  const auto frame = [](const std::string& layers) {
    scene::Scene scene =
        roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f));
    return Comparison(std::move(scene), cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}),
                      imagesAlone(R"({"max_theta_bins": 6, "max_phi_bins": 3)" + layers + "}"),
                      {.countDisocclusions = true});
  };
  const Comparison one = frame("");
  const Comparison two = frame(R"(, "depth_layers": 2)");
  const auto count = [](const Comparison& of, const char* name) {
    return of.output.counters.at(name);
  };
  EXPECT_EQ(count(one, "second_layer_hits"), 0u);
  EXPECT_GT(count(two, "second_layer_hits"), 100u);
  EXPECT_LT(count(two, "disoccluded") + count(two, "wrong_hit"),
            count(one, "disoccluded") + count(one, "wrong_hit"));
  EXPECT_LT(two.l1Of8Bit, 0.9 * one.l1Of8Bit);
  EXPECT_EQ(count(two, "depth_image_bytes"), 2 * count(one, "depth_image_bytes"));
  EXPECT_TRUE(two.finite);
  EXPECT_EQ(frame(R"(, "depth_layers": 2)").l1Of8Bit, two.l1Of8Bit);  // the same again
  // A planar mirror never needs it
  const auto plane = [](const char* options) {
    return Comparison(
        roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
        cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), options);
  };
  EXPECT_EQ(plane("{}").l1Of8Bit, plane(R"({"depth_layers": 2})").l1Of8Bit);
}

TEST(SecondOrder, EmptyImagesShowTheSky) {
  // Nothing but the mirror itself
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), builder.reflective(1.0f));
  builder.constantEnvironment(Vec3(1.0f));
  const Comparison frame(builder.scene(), cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}),
                         imagesAlone());
  EXPECT_GT(frame.output.counters.at("empty_images"), 0u);
  EXPECT_LE(frame.output.counters.at("empty_images"), frame.output.counters.at("clusters"));
  // A sample in a thousand at its rim meets a coarser level of the mirror itself
  EXPECT_LT(frame.meanDifference, 2e-3);
}

}  // namespace
}  // namespace catoptric::methods::second_order
