// GL and Embree share one definition of geometry, shading and materials: on the same samples their
// G-buffers agree but for silhouettes, and `traced` agrees with `reference`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "methods/test_harness.h"
#include "raster/scene_raster.h"
#include "scene/loader.h"
#include "trace/trace_scene.h"

namespace catoptric {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;

constexpr int kWidth = 192;
constexpr int kHeight = 144;

struct Subject {
  std::string name;
  scene::Scene scene;
  scene::Camera camera;
};

/// The scenes that need no prepared assets.
std::vector<Subject> subjects() {
  std::vector<Subject> list;

  // Everything that shading knows, in code: lights of all types, textures, a normal map.
  SceneBuilder builder;
  scene::Scene& s = builder.scene();
  s.ambient = Vec3(0.05f, 0.06f, 0.07f);
  s.environment.type = scene::EnvironmentType::Gradient;
  s.environment.color = Vec3(0.2f, 0.4f, 0.9f);
  s.environment.horizon = Vec3(0.8f);
  s.environment.ground = Vec3(0.1f);
  scene::BoxShape box;
  box.size = Vec3(6.0f, 3.0f, 6.0f);
  box.inward = true;
  box.faces = {true, true, true, true, false, true};  // open towards the camera
  builder.add(scene::makeBox(box, scene::UvMode::Metres), builder.diffuse(Vec3(0.7f, 0.6f, 0.5f)));
  builder.add(scene::makeSphere(0.7f, 64, 32, scene::UvMode::Unit),
              builder.reflective(0.6f, 0.0f, Vec3(0.3f, 0.5f, 0.4f), Vec3(0.9f, 0.8f, 0.7f)),
              translation({-1.0f, -0.6f, -0.5f}));
  builder.add(scene::makeTorus(0.6f, 0.25f, 64, 32, scene::UvMode::Unit),
              builder.reflective(0.3f, 0.4f, Vec3(0.8f, 0.2f, 0.2f)),
              translation({1.0f, -0.4f, -1.0f}) * rotation(60.0f, {1.0f, 0.3f, 0.0f}));
  builder.add(scene::makePlane({3.0f, 2.0f}, {1, 1}, scene::UvMode::Unit), builder.reflective(0.9f),
              translation({0.0f, 0.2f, -2.9f}) * rotation(90.0f, {1.0f, 0.0f, 0.0f}));
  for (scene::LightType type :
       {scene::LightType::Directional, scene::LightType::Point, scene::LightType::Spot}) {
    scene::Light light;
    light.type = type;
    light.position = {0.8f, 1.2f, 0.5f};
    light.direction = {-0.3f, -0.9f, -0.2f};
    light.intensity = Vec3(1.0f, 0.9f, 0.7f);
    light.range = type == scene::LightType::Point ? 6.0f : 0.0f;
    light.innerConeRad = 0.3f;
    s.lights.push_back(light);
  }
  list.push_back(
      {"code", s,
       scene::lookAt({0.4f, 0.3f, 4.5f}, {0.0f, -0.3f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f)});

  const std::filesystem::path folder = std::filesystem::path(CATOPTRIC_SOURCE_DIR) / "scenes";
  for (const char* name : {"cornell_box", "nine_spheres", "teapots", "planar_mirror",
                           "glossy_sphere", "normal_mapped", "moving", "deforming"}) {
    const std::filesystem::path file = folder / (std::string(name) + ".json");
    if (!std::filesystem::exists(file)) continue;
    Subject subject{name, scene::loadScene(file), {}};
    subject.camera = scene::defaultPath(subject.scene)->frame(1).camera;
    list.push_back(std::move(subject));
  }
  return list;
}

std::size_t at(int x, int y) {
  return static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
}

TEST(Agreement, GBuffersOfGlAndEmbreeAgreeOffSilhouettes) {
  gl::Context& context = gl::testContext();
  for (const Subject& subject : subjects()) {
    const test::Moment moment(subject.scene);
    raster::SceneRaster raster(subject.scene, moment.geometry);
    raster::GBuffer gbuffer = raster.makeGBuffer({kWidth, kHeight, 1, false});
    raster.drawGBuffer(gbuffer, subject.camera, moment.lighting);
    context.check("the G-buffer");
    const std::vector<float> diffuse = raster::readRgba(gbuffer.diffuse);
    const std::vector<float> normal = raster::readRgba(gbuffer.normal);
    const std::vector<std::uint32_t> ids = raster::readIds(gbuffer.object);
    const std::vector<float> depth = raster::readDepth(gbuffer.depth);

    // The same samples by Embree.
    const trace::TraceScene trace(subject.scene, moment.geometry, trace::BvhPolicy::Static);
    std::vector<trace::Ray> rays;
    const Vec3 forward = subject.camera.forward();
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        trace::Ray ray;
        ray.origin = subject.camera.eye();
        ray.direction =
            scene::rayDirection(subject.camera, kWidth, kHeight, static_cast<float>(x) + 0.5f,
                                static_cast<float>(y) + 0.5f);
        ray.near = subject.camera.nearMetres / glm::dot(ray.direction, forward);
        rays.push_back(ray);
      }
    }
    std::vector<trace::Hit> hits(rays.size());
    trace.intersect(rays, hits, true);
    const float spread = scene::pixelSpreadRad(subject.camera, kHeight);

    const auto zOf = [&](std::size_t i) {
      return hits[i].miss() ? 0.0f : hits[i].distance * glm::dot(rays[i].direction, forward);
    };
    int compared = 0;
    int wrongId = 0;
    int wrongDepth = 0;
    int wrongNormal = 0;
    int wrongDiffuse = 0;
    int wrongSpecular = 0;
    double worstDiffuse = 0.0;
    for (int y = 1; y + 1 < kHeight; ++y) {
      for (int x = 1; x + 1 < kWidth; ++x) {
        // Silhouettes: another object, or a jump in depth, among the neighbours.
        const std::size_t i = at(x, y);
        bool silhouette = false;
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            const std::size_t n = at(x + dx, y + dy);
            silhouette = silhouette || hits[n].object != hits[i].object ||
                         std::abs(zOf(n) - zOf(i)) > 0.1f * zOf(i);
          }
        }
        if (silhouette) continue;
        ++compared;
        if (static_cast<int>(ids[i]) != hits[i].object + 1) {
          ++wrongId;
          continue;
        }
        Vec3 expected = moment.lighting.environment->radiance(rays[i].direction);
        if (!hits[i].miss()) {
          const frame::SurfacePoint point = frame::shadeSurface(
              subject.scene, moment.geometry, moment.lighting, hits[i].object, hits[i].primitive,
              hits[i].u, hits[i].v, rays[i].origin + hits[i].distance * rays[i].direction,
              rays[i].direction, spread * hits[i].distance);
          expected = point.diffuse;
          const float z = subject.camera.nearMetres / depth[i];
          wrongDepth += std::abs(z - zOf(i)) > 1e-4f * zOf(i) ? 1 : 0;
          const Vec3 n(normal[4 * i], normal[4 * i + 1], normal[4 * i + 2]);
          wrongNormal += glm::dot(n, point.normal) < 0.9999f ? 1 : 0;
          wrongSpecular += std::abs(diffuse[4 * i + 3] - point.specularLevel) > 0.005f ||
                                   std::abs(normal[4 * i + 3] - point.glossiness) > 0.005f
                               ? 1
                               : 0;
        }
        const Vec3 drawn(diffuse[4 * i], diffuse[4 * i + 1], diffuse[4 * i + 2]);
        const float difference = glm::length(drawn - expected);
        wrongDiffuse += difference > 1e-3f + 0.01f * glm::length(expected) ? 1 : 0;
        worstDiffuse = std::max(worstDiffuse, static_cast<double>(difference));
      }
    }
    std::printf(
        "%-14s compared %d; differ: id %d, depth %d, normal %d, s or g %d, diffuse %d "
        "(worst %.4f)\n",
        subject.name.c_str(), compared, wrongId, wrongDepth, wrongNormal, wrongSpecular,
        wrongDiffuse, worstDiffuse);
    const int allowed = compared / 1000;
    EXPECT_GT(compared, kWidth * kHeight / 3) << subject.name;
    EXPECT_LE(wrongId, allowed) << subject.name;
    EXPECT_LE(wrongDepth, allowed) << subject.name;
    EXPECT_LE(wrongNormal, allowed) << subject.name;
    EXPECT_LE(wrongSpecular, allowed) << subject.name;
    EXPECT_LE(wrongDiffuse, allowed) << subject.name;
  }
}

TEST(Agreement, TracedConvergesToReferenceOnMirrors) {
  gl::Context& context = gl::testContext();
  Subject subject = subjects().front();
  for (scene::Material& material : subject.scene.materials) material.glossiness = 0.0f;
  const test::Moment moment(subject.scene);
  methods::RunSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.samples = 2;
  const std::unique_ptr<methods::Method> traced =
      methods::findMethod("traced").make(config::parseText("{}", "options"));
  raster::SceneRaster raster(subject.scene, moment.geometry);
  raster::GBuffer gbuffer = raster.makeGBuffer({kWidth, kHeight, 2, false});
  trace::TraceScene trace(subject.scene, moment.geometry, trace::BvhPolicy::Static);
  frame::StepTimer timer;
  methods::Services services{
      subject.scene, moment.geometry, moment.lighting, &raster, &gbuffer, &trace, timer};
  raster.drawGBuffer(gbuffer, subject.camera, moment.lighting);
  methods::FrameInput input;
  input.frame.camera = subject.camera;
  methods::FrameOutput output;
  traced->prepare(services, settings);
  traced->render(input, services, output);
  gl::Texture frame = gl::Texture::make2D("frame", GL_RGBA32F, kWidth, kHeight);
  raster.composite(gbuffer, subject.camera, {}, frame);
  context.check("traced");
  const std::vector<float> pixels = raster::readRgba(frame);
  EXPECT_GT(output.counters["rays"], 1000u);
  EXPECT_EQ(output.counters["refused"], 0u);

  // The reference takes the very same samples: what differs are silhouettes, seen or mirrored.
  const methods::FrameOutput truth = test::renderOnCpu(
      methods::findMethod("reference"), R"({"samples": 2})", moment, subject.camera, settings);
  int different = 0;
  double sum = 0.0;
  double light = 0.0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = at(x, y);
      float worst = 0.0f;
      for (int c = 0; c < 3; ++c) {
        const float d =
            std::abs(pixels[4 * i + static_cast<std::size_t>(c)] - truth.image->at(x, y, c));
        worst = std::max(worst, d);
        sum += static_cast<double>(d);
        light += static_cast<double>(truth.image->at(x, y, c));
      }
      different += worst > 0.01f ? 1 : 0;
    }
  }
  std::printf("traced against reference: mean difference %.2e, %d of %d pixels differ\n",
              sum / (3.0 * kWidth * kHeight), different, kWidth * kHeight);
  EXPECT_GT(light / (3.0 * kWidth * kHeight), 0.05);
  EXPECT_LE(different, kWidth * kHeight / 100);
  EXPECT_LT(sum / (3.0 * kWidth * kHeight), 1e-3);
}

}  // namespace
}  // namespace catoptric
