// The method's images against Embree's rays from the same samples.
#include <gtest/gtest.h>

#include <cmath>

#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "methods/second_order/second_order.h"
#include "scene/animate.h"
#include "scene/shapes/shapes.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

/// One frame of a scene by the method, and the light that Embree's rays find at its samples.
class Comparison {
 public:
  Comparison(scene::Scene scene, const scene::Camera& camera, const std::string& options = "{}")
      : context_(gl::testContext()),
        scene_(std::move(scene)),
        pose_(scene::poseAt(scene_, 0.0)),
        geometry_(frame::makeGeometry(scene_, pose_)),
        lighting_(frame::makeLighting(
            scene_, pose_, std::make_shared<frame::EnvironmentLight>(scene_.environment))),
        raster_(scene_, geometry_),
        trace_(scene_, geometry_, trace::BvhPolicy::Static) {
    settings_.width = settings_.height = 128;
    settings_.masks = true;
    settings_.layers = {"cluster"};
    raster::GBuffer gbuffer =
        raster_.makeGBuffer({settings_.width, settings_.height, settings_.samples, true});
    frame::StepTimer timer;
    timer.setFinish([] { gl::Context::current().finish("a step"); });
    Services services{scene_, geometry_, lighting_, &raster_, &gbuffer, &trace_, timer};
    const std::unique_ptr<Method> method =
        secondOrderEntry().make(config::parseText(options, "options"));
    method->prepare(services, settings_);
    raster_.drawGBuffer(gbuffer, camera, lighting_);
    FrameInput input;
    input.frame.camera = camera;
    method->render(input, services, output);
    context_.check("the frame");

    // The same samples by Embree
    raster::GBufferCopy copy;
    raster::readBack(gbuffer, false, copy);
    const std::vector<float> reflection = raster::readRgba(gbuffer.reflection);
    masks = raster::readMasks(gbuffer.masks);
    const Mat3 rays = scene::rayFromPixel(camera, copy.sampleWidth(), copy.sampleHeight());
    std::vector<trace::ReflectionPoint> points;
    std::vector<Vec3> ours;
    std::vector<bool> below;
    for (int y = 0; y < copy.sampleHeight(); ++y) {
      for (int x = 0; x < copy.sampleWidth(); ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * copy.sampleWidth() + x;
        const std::uint32_t object = copy.object[at];
        if (object == 0 || scene_.objects[object - 1].reflector == 0) continue;
        const Vec3 ray =
            rays * Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
        trace::ReflectionPoint point;
        const float scale = camera.nearMetres / copy.depth[at];
        point.position = camera.eye() + scale * ray;
        point.direction = glm::normalize(ray);
        point.distance = scale * glm::length(ray);
        point.normal = Vec3(copy.normal[4 * at], copy.normal[4 * at + 1], copy.normal[4 * at + 2]);
        point.glossiness = copy.normal[4 * at + 3];
        point.extent = trace_.extentOf(static_cast<int>(object) - 1);
        const int cell = (y % 2) * 2 + x % 2;  // as methods/traced
        point.shift = Vec2((static_cast<float>(cell) + 0.5f) / 4.0f,
                           glm::fract(static_cast<float>(cell) * 0.6180340f));
        points.push_back(point);
        below.push_back((masks[at] & raster::kMaskBelowHorizon) != 0);
        ours.emplace_back(reflection[4 * at], reflection[4 * at + 1], reflection[4 * at + 2]);
      }
    }
    std::vector<Vec3> radiance(points.size());
    traced = trace::reflectedRadiance(trace_, lighting_,
                                      scene::pixelSpreadRad(camera, copy.sampleHeight()), points,
                                      {.rays = 8}, true, radiance);
    samples = points.size();
    for (std::size_t i = 0; i < ours.size(); ++i) {
      const Vec3 d = glm::abs(ours[i] - radiance[i]);
      finite = finite && isFinite(ours[i]);
      brightest = std::max({brightest, ours[i].x, ours[i].y, ours[i].z});
      const float difference = (d.x + d.y + d.z) / 3.0f;
      meanDifference += static_cast<double>(difference) / static_cast<double>(ours.size());
      const auto eightBit = [](const Vec3& v) {
        return glm::clamp(glm::pow(glm::max(v, Vec3(0.0f)), Vec3(1.0f / 2.2f)), 0.0f, 1.0f) *
               255.0f;
      };
      const Vec3 shown = glm::abs(eightBit(ours[i]) - eightBit(radiance[i]));
      l1Of8Bit += static_cast<double>((shown.x + shown.y + shown.z) / 3.0f) /
                  static_cast<double>(ours.size());
      if (below[i]) differenceBelow += static_cast<double>(difference);
      different += difference > 0.02f ? 1.0 / static_cast<double>(ours.size()) : 0.0;
    }
    const auto count = std::count(below.begin(), below.end(), true);
    differenceBelow /= static_cast<double>(std::max<std::ptrdiff_t>(1, count));
  }

  FrameOutput output;
  std::vector<std::uint16_t> masks;
  trace::ReflectionCounts traced;
  std::size_t samples = 0;
  float brightest = 0.0f;
  double meanDifference = 0.0;  ///< of radiance
  double l1Of8Bit = 0.0;        ///< over reflective samples, of gamma 2.2 values
  double different = 0.0;       ///< share of samples that differ by more than 0.02
  /// Mean over the samples with kMaskBelowHorizon.
  double differenceBelow = 0.0;
  bool finite = true;

 private:
  gl::Context& context_;
  scene::Scene scene_;
  scene::Pose pose_;
  frame::Geometry geometry_;
  frame::Lighting lighting_;
  raster::SceneRaster raster_;
  trace::TraceScene trace_;
  RunSettings settings_;
};

/// Samples of the frame that have a bit of raster::MaskBit.
std::size_t marked(const Comparison& frame, std::uint16_t bit) {
  std::size_t count = 0;
  for (const std::uint16_t bits : frame.masks) count += (bits & bit) != 0;
  return count;
}

scene::Camera cameraAt(const Vec3& eye, const Vec3& target) {
  return scene::lookAt(eye, target, Vec3(0.0f, 1.0f, 0.0f), radians(50.0f));
}

/// A mirror (the first object) among coloured boxes in a room.
scene::Scene roomWith(scene::Mesh mirror, const Mat4& worldFromMirror, float glossiness = 0.0f) {
  test::SceneBuilder builder;
  builder.add(std::move(mirror), builder.reflective(1.0f, glossiness), worldFromMirror);
  const auto box = [&](const Vec3& centre, const Vec3& size, const Vec3& color) {
    builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres), builder.diffuse(color),
                glm::translate(Mat4(1.0f), centre));
  };
  box({0.0f, 1.5f, -4.0f}, {8.0f, 5.0f, 0.1f}, {0.8f, 0.3f, 0.2f});
  box({0.0f, 1.5f, 4.5f}, {8.0f, 5.0f, 0.1f}, {0.3f, 0.7f, 0.3f});
  box({-4.0f, 1.5f, 0.0f}, {0.1f, 5.0f, 9.0f}, {0.2f, 0.4f, 0.8f});
  box({4.0f, 1.5f, 0.0f}, {0.1f, 5.0f, 9.0f}, {0.8f, 0.8f, 0.3f});
  box({0.0f, 4.0f, 0.0f}, {8.0f, 0.1f, 9.0f}, {0.9f, 0.9f, 0.9f});
  box({0.0f, -1.1f, 0.0f}, {8.0f, 0.1f, 9.0f}, {0.5f, 0.4f, 0.3f});
  box({1.6f, 0.3f, -0.6f}, {0.5f, 1.4f, 0.5f}, {0.9f, 0.1f, 0.5f});
  box({-1.5f, -0.2f, 1.0f}, {0.4f, 0.8f, 0.4f}, {0.1f, 0.8f, 0.8f});
  builder.constantEnvironment(Vec3(1.0f));
  return builder.scene();
}

TEST(SecondOrder, SamplesNameTheirClusters) {
  const Comparison frame(roomWith(scene::makeSphere(0.7f, 64, 32, scene::UvMode::Unit), Mat4(1.0f)),
                         cameraAt({0.0f, 0.4f, 3.0f}, {0.0f, 0.0f, 0.0f}));
  const std::vector<Row>& rows = frame.output.tables.at(0).rows();
  std::vector<std::uint64_t> counts(rows.size() + 1, 0);
  for (const std::uint32_t cluster : frame.output.sampleLayers.at(0).numbers) ++counts.at(cluster);
  ASSERT_GT(counts.size(), 10u);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(counts[i + 1], static_cast<std::uint64_t>(std::get<std::int64_t>(rows[i][2])))
        << "cluster " << i;
  }
}

TEST(SecondOrder, APlanarMirrorIsExact) {
  const Comparison frame(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_TRUE(frame.finite);
  EXPECT_LT(frame.different, 0.002);  // edges within a rounding of a sample's centre
  EXPECT_LT(frame.meanDifference, 1e-3);
  EXPECT_EQ(frame.output.counters.at("planar_samples"), frame.samples);
  EXPECT_EQ(frame.output.counters.at("environment"), 0u);
}

TEST(SecondOrder, ASphereComesCloseToItsRays) {
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_TRUE(frame.finite);
  EXPECT_GT(frame.output.counters.at("clusters"), 20u);
  EXPECT_LT(frame.meanDifference, 0.012);
  EXPECT_LT(frame.different, 0.06);
  EXPECT_LT(static_cast<double>(frame.output.counters.at("environment")),
            0.02 * static_cast<double>(frame.samples));
}

TEST(SecondOrder, DimReflectionsAreDrawnMoreCoarsely) {
  // A ball of 24,000 triangles before the mirror
  const auto frame = [](float s, const char* options, float emission = 0.0f, float tint = 1.0f) {
    scene::Scene scene =
        roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f));
    const scene::Scene ball =
        roomWith(scene::makeSphere(0.6f, 160, 80, scene::UvMode::Metres), Mat4(1.0f));
    scene.meshes.back() = ball.meshes.front();
    scene::Material& mirror = scene.materials[scene.objects.front().material];
    mirror.specularLevel = s;
    mirror.reflectionTint = Vec3(tint);
    scene.materials[scene.objects.back().material].emissive = Vec3(emission);
    return Comparison(std::move(scene), cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), options);
  };
  const Comparison bright = frame(1.0f, "{}");
  const Comparison dim = frame(0.2f, "{}");
  const auto triangles = [](const Comparison& of) { return of.output.counters.at("triangles"); };
  EXPECT_LT(triangles(dim), 0.8 * static_cast<double>(triangles(bright)));
  EXPECT_LT(0.2 * dim.meanDifference, 1e-3);
  // Where a frame shows as much of it all the same
  EXPECT_EQ(triangles(frame(0.2f, "{}", 5.0f)), triangles(frame(1.0f, "{}", 5.0f)));
  EXPECT_EQ(triangles(frame(0.2f, "{}", 0.0f, 5.0f)), triangles(bright));
  // Always the finest level: as many of both
  const char* const finest = R"({"level_error": 0})";
  EXPECT_EQ(triangles(frame(0.2f, finest)), triangles(frame(1.0f, finest)));
  EXPECT_GT(triangles(frame(1.0f, finest)), triangles(bright));
}

TEST(SecondOrder, SmallThingsAreNotLeftOutOfDimReflections) {
  // Balls a texel or two wide before a dim mirror
  const auto frame = [](float s, const char* options = "{}") {
    test::SceneBuilder builder;
    builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres),
                builder.reflective(s, 0.0f));
    for (int i = 0; i < 25; ++i) {
      const Vec3 at(0.3f * static_cast<float>(i % 5 - 2), 0.3f * static_cast<float>(i / 5 - 2),
                    2.0f);
      builder.add(scene::makeSphere(0.02f, 12, 6, scene::UvMode::Metres),
                  builder.diffuse(Vec3(0.8f)), test::translation(at));
    }
    builder.constantEnvironment(Vec3(1.0f));
    return Comparison(builder.scene(), cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), options);
  };
  const Comparison dim = frame(0.06f);
  const Comparison bright = frame(1.0f);
  EXPECT_GT(bright.output.counters.at("triangles"), 200u);
  EXPECT_GT(dim.output.counters.at("triangles"),
            0.9 * static_cast<double>(bright.output.counters.at("triangles")));
  EXPECT_NEAR(dim.meanDifference, bright.meanDifference, 0.1 * bright.meanDifference);
  // What is left out is counted
  const Comparison coarse = frame(1.0f, R"({"level_error": 16})");
  const auto leftOut = [](const Comparison& of) { return of.output.counters.at("left_out"); };
  EXPECT_EQ(leftOut(dim), leftOut(bright));
  EXPECT_GT(leftOut(coarse), leftOut(bright));
  EXPECT_LT(coarse.output.counters.at("triangles"), bright.output.counters.at("triangles"));
  EXPECT_EQ(leftOut(frame(1.0f, R"({"level_error": 0})")), 0u);
}

TEST(SecondOrder, AmongManyReflectorsEachComesCloseToItsRays) {
  // Bright balls between dark mirrors
  test::SceneBuilder builder;
  const scene::Mesh ball = scene::makeSphere(0.14f, 32, 16, scene::UvMode::Metres);
  const int mirror = builder.reflective(0.12f, 0.0f);
  const int lamp = builder.diffuse(Vec3(0.9f, 0.8f, 0.5f), Vec3(6.0f, 5.0f, 3.0f));
  for (int i = 0; i < 49; ++i) {
    const Vec3 at(0.4f * static_cast<float>(i % 7 - 3), 0.0f, 0.4f * static_cast<float>(i / 7 - 3));
    builder.add(ball, mirror, test::translation(at));
    builder.add(ball, lamp, test::translation(at + Vec3(0.2f, 0.0f, 0.2f)));
  }
  builder.constantEnvironment(Vec3(0.05f));
  const Comparison frame(builder.scene(), cameraAt({0.3f, 1.6f, 2.4f}, {0.0f, 0.0f, 0.2f}));
  EXPECT_GT(frame.samples, 10000u);
  EXPECT_TRUE(frame.finite);
  EXPECT_LT(frame.meanDifference, 0.38);  // 0.31; with a bin each 0.51
}

/// A mirror whose normals a map turns by up to 70 degrees, by texels.
scene::Scene roomWithBent(scene::Mesh mirror, float glossiness = 0.0f) {
  mirror.tangents.clear();
  for (const Vec3& n : mirror.normals) {
    const Vec3 side = std::abs(n.y) < 0.9f ? Vec3(0.0f, 1.0f, 0.0f) : Vec3(1.0f, 0.0f, 0.0f);
    mirror.tangents.emplace_back(glm::normalize(glm::cross(n, side)), 1.0f);
  }
  scene::Scene scene = roomWith(std::move(mirror), Mat4(1.0f), glossiness);
  scene::Texture texture;
  texture.srgb = false;
  texture.nearest = true;
  std::vector<std::uint8_t> texels;
  for (const glm::u8vec3 m : {glm::u8vec3{128, 128, 255},
                              {247, 128, 170},
                              {8, 128, 170},
                              {128, 247, 170},
                              {128, 8, 170},
                              {190, 190, 218},
                              {66, 66, 218},
                              {128, 230, 200},
                              {128, 128, 255}}) {
    texels.insert(texels.end(), {m.x, m.y, m.z, 255});
  }
  texture.levels.push_back({3, 3, texels});
  scene.textures.push_back(texture);
  scene.materials[0].normalTexture.texture = 0;
  scene.objects[0].planar = false;
  return scene;
}

TEST(SecondOrder, NormalMapsTurnRaysBelowTheSurfaceAsTheyDoForTraced) {
  for (const float glossiness : {0.0f, 0.2f}) {
    for (const bool round : {false, true}) {
      const Comparison frame(
          roomWithBent(round ? scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres)
                             : scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres),
                       glossiness),
          cameraAt({0.7f, 0.6f, 3.2f}, {0.0f, 0.0f, 0.0f}));
      SCOPED_TRACE(std::to_string(glossiness) + (round ? ", sphere" : ", plane"));
      EXPECT_TRUE(frame.finite);
      const std::uint64_t folded = frame.output.counters.at("below_horizon");
      EXPECT_GT(frame.traced.belowHorizon, 500u);
      EXPECT_NEAR(static_cast<double>(folded), static_cast<double>(frame.traced.belowHorizon),
                  (glossiness > 0.0f ? 0.02 : 0.001) *  // lobes in no cluster have no rays
                      static_cast<double>(frame.traced.belowHorizon));
      EXPECT_GT(frame.output.counters.at("met_itself"), 1000u);
      if (glossiness == 0.0f) {
        EXPECT_EQ(marked(frame, raster::kMaskBelowHorizon), folded);
        EXPECT_LT(frame.differenceBelow, 0.01);  // such rays meet their own surface
      }
    }
  }
}

TEST(SecondOrder, FinerDepthImagesErrLess) {
  const auto error = [](const char* options) {
    return Comparison(roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
                      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), options)
        .meanDifference;
  };
  const double coarse = error(R"({"depth_image_scale": 0.3333})");
  const double plain = error("{}");
  const double fine = error(R"({"depth_image_scale": 2})");
  EXPECT_LT(plain, coarse);
  EXPECT_LT(fine, plain);
}

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
                      cameraAt({0.4f, 0.8f, 2.0f}, {0.0f, 0.0f, 0.0f}), options);
  };
  const Comparison plain = frame(R"({"depth_image_scale": 2})");
  const Comparison small = frame(R"({"depth_image_scale": 2, "memory_mib": 1})");
  EXPECT_GT(plain.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_LE(small.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_EQ(plain.output.counters.at("images_shrunk"), 0u);
  EXPECT_GT(small.output.counters.at("images_shrunk"), 0u);
  EXPECT_TRUE(small.finite);
  EXPECT_LT(small.meanDifference, 0.03);

  // A mirror whose grid is shrunk is looked up between texels
  const Comparison mirror(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.2f, 0.5f, 1.2f}, {0.0f, 0.0f, 0.0f}),
      R"({"memory_mib": 1, "depth_image_scale": 1.5})");
  EXPECT_LE(mirror.output.counters.at("depth_image_bytes"), 1u << 20);
  EXPECT_GT(mirror.output.counters.at("images_shrunk"), 0u);
  EXPECT_LT(mirror.meanDifference, 0.02);
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
    return Comparison(
        std::move(scene), cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}),
        R"({"max_theta_bins": 6, "max_phi_bins": 3, "count_disocclusions": true)" + layers + "}");
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
  const Comparison frame(builder.scene(), cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  EXPECT_GT(frame.output.counters.at("empty_images"), 0u);
  EXPECT_LE(frame.output.counters.at("empty_images"), frame.output.counters.at("clusters"));
  // A sample in a thousand at its rim meets a coarser level of the mirror itself
  EXPECT_LT(frame.meanDifference, 2e-3);
}

TEST(SecondOrder, WhatFallsBackIsMarkedAndCounted) {
  // Clusters that are all too small to search
  const Comparison frame(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), R"({"min_cluster_samples": 1000000})");
  EXPECT_EQ(frame.output.counters.at("clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("planar_clusters"), 0u);
  EXPECT_EQ(frame.output.counters.at("unclustered"), frame.samples);
  EXPECT_EQ(marked(frame, raster::kMaskEnvironment), frame.samples);
}

TEST(SecondOrder, DisocclusionsAreToldFromTrueMisses) {
  const char* options = R"({"count_disocclusions": true})";
  const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  // A planar mirror has none
  const Comparison plane(
      roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, scene::UvMode::Metres), Mat4(1.0f)),
      cameraAt({0.7f, 1.5f, 3.2f}, {0.0f, 0.0f, 0.0f}), options);
  EXPECT_EQ(plane.output.counters.at("disoccluded"), 0u);
  EXPECT_EQ(plane.output.counters.at("wrong_hit"), 0u);
  // In a closed room every ray hits: what found nothing is disoccluded, for mirrors and lobes
  for (const float glossiness : {0.0f, 0.3f}) {
    const Comparison closed(
        roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), glossiness),
        camera, options);
    const std::uint64_t missed = closed.output.counters.at("environment");
    EXPECT_GE(closed.output.counters.at("disoccluded"), missed);
    EXPECT_LE(closed.output.counters.at("disoccluded"), missed + closed.output.counters.at("sky"));
    EXPECT_EQ(marked(closed, raster::kMaskDisoccluded), closed.output.counters.at("disoccluded"));
    EXPECT_LT(static_cast<double>(closed.output.counters.at("wrong_hit")),
              0.05 * static_cast<double>(closed.samples));
  }
  // Alone under the sky nothing is, but where smooth normals send rays through the next facet
  test::SceneBuilder builder;
  builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), builder.reflective(1.0f));
  builder.constantEnvironment(Vec3(1.0f));
  const Comparison open(builder.scene(), camera, options);
  EXPECT_GT(open.output.counters.at("sky"), 10000u);
  EXPECT_LT(open.output.counters.at("disoccluded") + open.output.counters.at("wrong_hit"),
            open.samples / 500);
  // Not asked for, not counted
  const Comparison plain(builder.scene(), camera);
  EXPECT_EQ(plain.output.counters.count("disoccluded"), 0u);
}

TEST(SecondOrder, WhatFindsNothingSeesTheSkyOrTheCubeMap) {
  // Alone under a sky of one radiance, which both show; where smooth normals send rays through the
  // next facet Embree's rays meet the mirror
  for (const float glossiness : {0.0f, 0.3f}) {
    test::SceneBuilder builder;
    builder.add(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres),
                builder.reflective(1.0f, glossiness));
    builder.constantEnvironment(Vec3(0.25f, 0.5f, 0.75f));
    const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
    const Comparison sky(builder.scene(), camera);
    EXPECT_GT(sky.output.counters.at("sky"), 10000u);
    EXPECT_EQ(marked(sky, raster::kMaskSky), sky.output.counters.at("sky"));
    EXPECT_LT(sky.different, 0.02);

    // A plane: not seen from the place of its cube map, on itself
    test::SceneBuilder flat;
    flat.add(scene::makePlane({2.0f, 2.0f}, {1, 1}, scene::UvMode::Metres),
             flat.reflective(1.0f, glossiness));
    flat.constantEnvironment(Vec3(0.25f, 0.5f, 0.75f));
    const Comparison none(flat.scene(), camera, R"({"min_cluster_samples": 1000000})");
    EXPECT_EQ(none.output.counters.at("unclustered"), none.samples);
    EXPECT_EQ(marked(none, raster::kMaskEnvironment), none.samples);
    EXPECT_LT(none.different, 0.02);
  }
}

/// The part of a sphere below a height share (-1..1) along its axis +z, seen from the inside.
scene::Mesh bowl(float radius, float until) {
  scene::Mesh mesh = scene::makeSphere(radius, 96, 64, scene::UvMode::Metres);
  std::vector<std::uint32_t> kept;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      inside = inside && mesh.positions[mesh.indices[t + k]].z <= until * radius;
    }
    if (inside)
      kept.insert(kept.end(), {mesh.indices[t], mesh.indices[t + 2], mesh.indices[t + 1]});
  }
  mesh.indices = kept;
  for (Vec3& normal : mesh.normals) normal = -normal;
  return mesh;
}

/// A bowl of radius 2 m whose centre is at z = 1, its vertex at z = -1 and its focus at z = 0, with
/// a box `distance` metres before its vertex.
scene::Scene roomWithBowl(float until, float distance) {
  const scene::UvMode uv = scene::UvMode::Metres;
  test::SceneBuilder builder;
  builder.add(bowl(2.0f, until), builder.reflective(1.0f), test::translation({0.0f, 0.0f, 1.0f}));
  builder.add(scene::makeBox({.size = {0.3f, 0.3f, 0.3f}}, uv), builder.diffuse({0.9f, 0.2f, 0.1f}),
              test::translation({0.15f, -0.1f, -1.0f + distance}));
  builder.add(scene::makeBox({.size = {9.0f, 6.0f, 0.1f}}, uv), builder.diffuse({0.3f, 0.7f, 0.3f}),
              test::translation({0.0f, 0.0f, 6.0f}));
  builder.add(scene::makeBox({.size = {9.0f, 0.1f, 9.0f}}, uv), builder.diffuse({0.3f, 0.3f, 0.8f}),
              test::translation({0.0f, -2.5f, 2.0f}));
  builder.constantEnvironment(Vec3(0.8f));
  return builder.scene();
}

TEST(SecondOrder, ConcaveMirrorsComeCloseToTheirRays) {
  const scene::Camera camera = cameraAt({0.9f, 0.7f, 2.6f}, {0.0f, 0.0f, -1.0f});
  for (const float distance : {0.5f, 1.0f, 1.8f}) {  // inside the focus, at it, outside
    const Comparison shallow(roomWithBowl(-0.7f, distance), camera);
    EXPECT_TRUE(shallow.finite);
    EXPECT_EQ(shallow.output.counters.at("concave_clusters"),
              shallow.output.counters.at("clusters"));
    EXPECT_LT(shallow.l1Of8Bit, 5.0) << distance;
    const Comparison deep(roomWithBowl(-0.2f, distance), camera);
    EXPECT_TRUE(deep.finite);
    EXPECT_LT(deep.l1Of8Bit, 13.0) << distance;
  }
}

TEST(SecondOrder, ConcaveReflectorsCanMeetThemselves) {
  // A deep bowl, in one cluster and in many: rays from one side meet the other
  for (const bool one : {true, false}) {
    const std::string bins = one ? R"("max_theta_bins": 1, "max_phi_bins": 1, )" : "";
    const auto frame = [&](const std::string& concave) {
      return Comparison(roomWithBowl(0.3f, 1.0f),
                        cameraAt({2.0f, 0.1f, 3.0f}, {-0.2f, 0.0f, -0.4f}),
                        "{" + bins + "\"concave\": \"" + concave + "\"}");
    };
    const Comparison ignored = frame("ignore");
    const Comparison met = frame("self_intersect");
    const Comparison all = frame("self_intersect_all");
    EXPECT_TRUE(met.finite && all.finite);
    EXPECT_EQ(ignored.output.counters.at("met_itself"), 0u);
    EXPECT_GT(met.output.counters.at("met_itself"), 1000u);
    EXPECT_GE(all.output.counters.at("met_itself"), met.output.counters.at("met_itself"));
    // Of many clusters each sees the bowl above it anyway
    EXPECT_LT(met.l1Of8Bit, (one ? 0.6 : 1.02) * ignored.l1Of8Bit);
    EXPECT_LE(all.l1Of8Bit, met.l1Of8Bit);
  }
  // A ball does not
  const Comparison ball(
      roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), 0.0f),
      cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}), R"({"concave": "self_intersect_all"})");
  EXPECT_EQ(ball.output.counters.at("met_itself"), 0u);
}

TEST(SecondOrder, NoSkyIsSeenThroughTheGapsOfAClosedRoom) {
  // A handle at a wall: many of its rays find nothing in their clusters' depth images
  for (const float glossiness : {0.0f, 0.2f}) {
    test::SceneBuilder builder;
    builder.add(scene::makeTorus(0.15f, 0.02f, 48, 16, scene::UvMode::Metres),
                builder.reflective(1.0f, glossiness), test::translation({0.0f, 0.0f, -0.95f}));
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 size(2.2f);
      size[axis] = 0.1f;
      for (const float side : {-1.05f, 1.05f}) {
        Vec3 centre(0.0f);
        centre[axis] = side;
        builder.add(scene::makeBox({.size = size}, scene::UvMode::Metres),
                    builder.diffuse(Vec3(0.3f)), test::translation(centre));
      }
    }
    builder.constantEnvironment(Vec3(100.0f));  // the walls show 30 of it, the handle at most 50
    const Comparison frame(builder.scene(), cameraAt({0.2f, 0.3f, -0.4f}, {0.0f, 0.0f, -0.95f}));
    EXPECT_GT(frame.samples, 1000u);
    EXPECT_GT(frame.output.counters.at("sky"), 20u) << "nothing is tested";
    EXPECT_LT(frame.brightest, 51.0f);
  }
}

TEST(SecondOrder, GlossyReflectionsComeCloseToTheirRays) {
  const scene::Camera camera = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  const auto frame = [&](const char* options) {
    return Comparison(
        roomWith(scene::makeSphere(1.0f, 96, 48, scene::UvMode::Metres), Mat4(1.0f), 0.3f), camera,
        options);
  };
  const Comparison cone = frame("{}");
  EXPECT_LT(cone.l1Of8Bit, 3.0);
  const Comparison neighbourhood = frame(R"({"glossy": "neighbourhood"})");
  EXPECT_TRUE(neighbourhood.finite);
  EXPECT_LT(neighbourhood.l1Of8Bit, 3.0);
  // Within a far reach nothing fades, within a short one all does; between, what is far
  EXPECT_NEAR(frame(R"({"glossy_reach": 100000})").l1Of8Bit, cone.l1Of8Bit, 0.1);
  const Comparison shortest = frame(R"({"glossy_reach": 1e-4})");
  EXPECT_EQ(shortest.output.counters.at("faded") + shortest.output.counters.at("unclustered"),
            shortest.samples);
  const Comparison between = frame(R"({"glossy_reach": 1})");
  EXPECT_TRUE(between.finite);
  EXPECT_GT(between.l1Of8Bit, 2.0 * cone.l1Of8Bit);
  EXPECT_GT(between.output.counters.at("faded"), 0u);
  EXPECT_LT(between.output.counters.at("faded"), between.samples);
  // What lies wholly beyond a reach of 0.23 m is not drawn; the floor is within, and the mirror
  // itself
  const Comparison near = frame(R"({"glossy_reach": 0.1})");
  EXPECT_LT(near.output.counters.at("triangles"), cone.output.counters.at("triangles"));
  EXPECT_GT(near.output.counters.at("triangles"), 0u);
}

TEST(SecondOrder, ExtremesStayWithinTheirBounds) {
  const scene::UvMode uv = scene::UvMode::Metres;
  const auto expectWithin = [](double bound, scene::Scene scene, const scene::Camera& camera,
                               const char* options = "{}") {
    const Comparison frame(std::move(scene), camera, options);
    EXPECT_TRUE(frame.finite);
    EXPECT_GT(frame.samples, 0u);
    EXPECT_LT(frame.l1Of8Bit, bound);
  };
  const auto sphere = [&](float radius) {
    return roomWith(scene::makeSphere(radius, 96, 48, uv), Mat4(1.0f));
  };
  const scene::Camera aside = cameraAt({0.0f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  // A sphere that fills the frame, one of about 3 pixels (no cluster: the cube map)
  expectWithin(0.5, sphere(1.0f), cameraAt({0.0f, 0.0f, 1.3f}, {0.0f, 0.0f, 0.0f}));
  expectWithin(20.0, sphere(0.03f), aside);
  // From inside a sphere, whose far side only Embree's rays find
  expectWithin(16.0, sphere(1.0f), cameraAt({0.0f, 0.0f, 0.3f}, {0.0f, 0.0f, -1.0f}));
  expectWithin(0.5, sphere(0.1f), aside,
               R"({"min_cluster_samples": 1, "max_theta_bins": 128, "max_phi_bins": 64,
                   "bin_density": 1000})");  // a sample each
  // Edge-on
  expectWithin(0.1, roomWith(scene::makePlane({4.0f, 4.0f}, {1, 1}, uv), Mat4(1.0f)),
               cameraAt({0.0f, 0.01f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectWithin(2.0, roomWith(scene::makeTorus(0.7f, 0.25f, 48, 24, uv), Mat4(1.0f)),
               cameraAt({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, 0.0f}));
  // 500 reflectors, a cluster or less each: no better than the cube map
  test::SceneBuilder many;
  const int mirror = many.reflective(0.8f);
  for (int i = 0; i < 500; ++i) {
    const int column = i % 25 - 12;
    const int row = i / 25 - 10;
    many.add(scene::makeSphere(0.1f, 24, 12, uv), mirror,
             test::translation(
                 {0.3f * static_cast<float>(column), 0.3f * static_cast<float>(row), 0.0f}));
  }
  many.add(scene::makeBox({.size = {9.0f, 9.0f, 0.1f}}, uv), many.diffuse({0.3f, 0.7f, 0.3f}),
           test::translation({0.0f, 0.0f, -1.0f}));
  many.add(scene::makeBox({.size = {0.1f, 9.0f, 9.0f}}, uv), many.diffuse({0.8f, 0.7f, 0.3f}),
           test::translation({4.5f, 0.0f, 3.0f}));
  many.constantEnvironment(Vec3(0.8f));
  expectWithin(27.0, many.scene(), cameraAt({0.0f, 0.8f, 6.6f}, {0.0f, 0.0f, 0.0f}));
  // None at all
  test::SceneBuilder none;
  none.add(scene::makeSphere(1.0f, 24, 12, uv), none.diffuse(Vec3(0.5f)));
  const Comparison empty(none.scene(), aside);
  EXPECT_EQ(empty.samples, 0u);
  EXPECT_EQ(empty.output.counters.at("sky"), 0u);
}

/// Strips side by side in the plane z = 0, with shading normals to the right and to the left, which
/// turn a little so that no neighbours make a plane.
scene::Mesh stripsOfOppositeNormals() {
  scene::Mesh mesh;
  for (int i = 0; i < 16; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const float left = -1.0f + 0.125f * static_cast<float>(i);
    for (const Vec2& corner :
         {Vec2(0.0f, -1.0f), Vec2(0.125f, -1.0f), Vec2(0.125f, 1.0f), Vec2(0.0f, 1.0f)}) {
      mesh.positions.emplace_back(left + corner.x, corner.y, 0.0f);
      const float turn = corner.x > 0.0f ? 0.2f : -0.2f;
      mesh.normals.emplace_back((i % 2 == 0 ? 1.0f : -1.0f) * std::cos(turn), std::sin(turn), 0.0f);
    }
    for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) {
      mesh.indices.push_back(first + corner);
    }
  }
  return mesh;
}

TEST(SecondOrder, DegenerateClustersAreCountedAndStayWithinTheirBounds) {
  const scene::UvMode uv = scene::UvMode::Metres;
  const std::string oneBin = R"("max_theta_bins": 1, "max_phi_bins": 1)";
  const auto expectCounted = [](const char* counter, double bound, scene::Scene scene,
                                const scene::Camera& camera, const std::string& options) {
    const Comparison frame(std::move(scene), camera, "{" + options + "}");
    EXPECT_GT(frame.output.counters.at(counter), 0u) << counter;
    EXPECT_TRUE(frame.finite) << counter;
    EXPECT_GT(frame.samples, 1000u) << counter;
    EXPECT_LT(frame.l1Of8Bit, bound) << counter;
  };
  const auto sphere = [&] { return roomWith(scene::makeSphere(1.0f, 96, 48, uv), Mat4(1.0f)); };
  const scene::Camera before = cameraAt({0.4f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f});
  const scene::Camera atFocus = cameraAt({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f});
  // The eye in a bowl's focus sends parallel rays; from beyond its centre they cross
  expectCounted("parallel_clusters", 6.0, roomWithBowl(-0.2f, 0.9f), atFocus, "");
  expectCounted("crossing_clusters", 13.0, roomWithBowl(-0.2f, 1.8f),
                cameraAt({0.9f, 0.7f, 2.6f}, {0.0f, 0.0f, -1.0f}), "");
  // A whole sphere in a cluster bends more than a camera can follow
  expectCounted("pushed_back", 30.0, sphere(), before, oneBin);
  expectCounted("capped_images", 4.0, sphere(), before, R"("max_texels_per_sample": 0.25)");
  // Rays of such normals run on behind the surface: only finite
  expectCounted("normals_cancel", 256.0, roomWith(stripsOfOppositeNormals(), Mat4(1.0f)),
                cameraAt({0.0f, 0.0f, 3.6f}, {0.0f, 0.0f, 0.0f}), oneBin);
  test::SceneBuilder many;
  const int mirror = many.reflective(0.8f);
  for (int i = 0; i < 100; ++i) {
    const Vec3 place(0.25f * static_cast<float>(i % 10 - 5), 0.25f * static_cast<float>(i / 10 - 5),
                     0.0f);
    many.add(scene::makeSphere(0.1f, 24, 12, uv), mirror, test::translation(place));
  }
  many.constantEnvironment(Vec3(0.8f));
  expectCounted("bins_halved", 30.0, many.scene(), before,
                R"("max_theta_bins": 128, "max_phi_bins": 64, "bin_density": 1000)");
}

TEST(SecondOrder, OddReflectorsStayFinite) {
  const auto expectFinite = [](scene::Mesh mesh, const Mat4& place, const scene::Camera& camera) {
    const Comparison frame(roomWith(std::move(mesh), place), camera);
    EXPECT_TRUE(frame.finite);
  };
  const scene::UvMode uv = scene::UvMode::Metres;
  // From inside a sphere, a sphere of about 3 pixels, edge-on, a sphere that fills the frame
  expectFinite(scene::makeSphere(1.0f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.0f, 0.3f}, {0.0f, 0.0f, -1.0f}));
  expectFinite(scene::makeSphere(0.03f, 24, 12, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.8f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makePlane({4.0f, 4.0f}, {1, 1}, uv), Mat4(1.0f),
               cameraAt({0.0f, 1e-4f, 3.6f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makeSphere(1.0f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.0f, 0.0f, 1.02f}, {0.0f, 0.0f, 0.0f}));
  expectFinite(scene::makeTorus(0.7f, 0.25f, 48, 24, uv), Mat4(1.0f),
               cameraAt({0.4f, 1.5f, 2.0f}, {0.0f, 0.0f, 0.0f}));
}

}  // namespace
}  // namespace catoptric::methods
