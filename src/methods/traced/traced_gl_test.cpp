// Frames in bands against the same points traced as one list, and what the options change.
#include "methods/traced/traced.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "methods/testing/gl_harness.h"
#include "scene/loader.h"
#include "scene/reflectance.h"

namespace catoptric::methods {
namespace {

scene::Scene sceneOf(const std::string& name) {
  return scene::loadScene(std::string(CATOPTRIC_SOURCE_DIR) + "/scenes/" + name + ".json");
}

const Vec3 kEye(1.0f, 1.8f, 5.0f);
scene::Camera spheres() {
  return scene::lookAt(kEye, {0.0f, 0.6f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.7f);
}

/// Light of points where rays meet only objects that do not reflect.
std::vector<Vec3> overDiffuse(test::GlStage& stage, const scene::Camera& camera,
                              const std::vector<trace::ReflectionPoint>& points,
                              const trace::ReflectionOptions& options) {
  trace::TraceOptions only;
  for (std::size_t i = 0; i < stage.scene.objects.size(); ++i)
    if (stage.scene.objects[i].reflector == 0) only.objects.push_back(static_cast<int>(i));
  const trace::TraceScene diffuse(stage.scene, stage.moment.geometry, trace::BvhPolicy::Static,
                                  only);
  std::vector<Vec3> radiance(points.size());
  trace::reflectedRadiance(
      diffuse, stage.moment.lighting,
      scene::pixelSpreadRad(camera, stage.settings.height * stage.settings.samples), points,
      options, true, radiance);
  return radiance;
}

TEST(Traced, BandsAreTheSameAsOneList) {
  // Borders of tiles and of bands (of 65,536 samples) within the frame, and cells of 3 x 3 samples.
  const std::array<std::array<int, 3>, 3> sizes = {{{75, 53, 3}, {331, 300, 1}, {150, 140, 2}}};
  for (const auto& [width, height, samples] : sizes) {
    test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(width, height, samples, true));
    test::GlMethod method(stage, tracedEntry(), R"({"rays": 5})");
    const FrameOutput output = method.render(spheres());
    const test::TracedSamples seen(stage, spheres(), {.rays = 5});
    EXPECT_GT(seen.places.size(), 2000u);
    EXPECT_EQ(seen.ours, seen.traced) << width << " x " << height;
    EXPECT_EQ(output.counters.at("rays"), seen.counts.rays);
    EXPECT_EQ(output.counters.at("misses"), seen.counts.misses);
    const auto masks = raster::readMasks(stage.gbuffer.masks);
    std::uint64_t sky = 0;
    for (const std::uint16_t mask : masks) sky += (mask & raster::kMaskSky) != 0 ? 1 : 0;
    EXPECT_EQ(sky > 0, seen.counts.misses > 0);
  }
}

TEST(Traced, MeetsDiffuseObjectsAlone) {
  test::GlStage stage(sceneOf("nine_spheres"), test::framesOf(120, 120, 1));
  test::GlMethod all(stage, tracedEntry());
  all.render(spheres());
  const test::TracedSamples everything(stage, spheres(), {.rays = 8});
  test::GlMethod method(stage, tracedEntry(), R"({"objects": "diffuse", "rays": 8})");
  const FrameOutput output = method.render(spheres());
  const test::TracedSamples seen(stage, spheres(), {.rays = 8});
  EXPECT_EQ(seen.ours, overDiffuse(stage, spheres(), seen.points, {.rays = 8}));
  EXPECT_NE(seen.ours, everything.traced);  // balls reflect each other
  EXPECT_EQ(output.counters.at("rays"), everything.counts.rays);
}

}  // namespace
}  // namespace catoptric::methods
