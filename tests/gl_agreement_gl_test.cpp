// GL and Embree share one definition of geometry, shading and materials: on the same samples their
// G-buffers agree but for silhouettes, and `traced` agrees with `reference`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "methods/shared/reflective_samples.h"
#include "methods/testing/cpu_harness.h"
#include "raster/scene_raster.h"
#include "scene/loader.h"
#include "trace/bake/bake.h"
#include "trace/embree/trace_scene.h"

namespace catoptric {
namespace {

using test::rotation;
using test::SceneBuilder;
using test::translation;

const std::filesystem::path kRoot = CATOPTRIC_SOURCE_DIR;
constexpr int kWidth = 192;
constexpr int kHeight = 144;

struct Subject {
  scene::Scene scene;
  scene::Camera camera;
};

/// Everything that shading knows of lights, in code.
Subject codeScene() {
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
  const Subject subject{
      s, scene::lookAt({0.4f, 0.3f, 4.5f}, {0.0f, -0.3f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f)};
  return subject;
}

/// A scene of scenes/ with a few frames of its paths. Rooms are lit by a quick bake.
struct SceneFile {
  const char* name;
  std::vector<const char*> paths;  ///< none: the scene's own camera
  bool moves = false;
};

const std::vector<SceneFile>& sceneFiles() {
  static const std::vector<SceneFile> files{
      {"cornell_box", {"cornell_box"}},
      {"nine_spheres", {"nine_spheres"}},
      {"teapots", {"teapots"}},
      {"planar_mirror", {"planar_mirror"}},
      {"glossy_sphere", {"glossy_sphere"}},
      {"normal_mapped", {"normal_mapped"}},
      {"moving", {"moving"}, true},
      {"deforming", {"deforming"}, true},
      {"living_room", {"living_room_a", "living_room_b"}},
      {"bathroom", {"bathroom_a", "bathroom_b"}},
      {"lens", {"lens"}},
      {"user_formula", {"user_formula"}},
      {"vase_lizard", {"vase_lizard"}, true},
      {"vase_sphere", {"vase_sphere"}},
      {"vase_window", {"vase_window"}, true},
  };
  return files;
}

std::size_t at(int x, int y) {
  return static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
}

/// Samples of one view that differ between GL and Embree.
struct Differences {
  int compared = 0;
  int id = 0;
  int depth = 0;
  int normal = 0;
  int specular = 0;
  int diffuse = 0;
  double worstDiffuse = 0.0;
  int twins = 0;  ///< right for the other of two coincident triangles
  /// Of all rays that the view's reflective samples send, with two bounces and two rays a lobe.
  trace::ReflectionCounts reflected;
};

/// What GL has drawn and what Embree sees of one moment.
struct Seen {
  const test::Moment& moment;
  raster::SceneRaster& raster;
  raster::GBuffer& gbuffer;
  const trace::TraceScene& trace;
};

bool agrees(const Vec3& drawn, const Vec3& expected) {
  return glm::length(drawn - expected) <= 1e-3f + 0.01f * glm::length(expected);
}

/// The hit on another triangle with the same corners: models of cloth and paper have two layers in
/// one place, each with baked light of its own, and either may be seen. A miss when there is none.
trace::Hit twinOf(const frame::Geometry& geometry, const trace::Hit& hit) {
  const frame::ObjectRange& range = geometry.objects[hit.object];
  const auto corner = [&](std::uint32_t primitive, std::uint32_t k) {
    return geometry.positions[geometry.indices[range.firstIndex + 3 * primitive + k]];
  };
  const std::array<float, 3> weights{1.0f - hit.u - hit.v, hit.u, hit.v};
  for (std::uint32_t p = 0; p < range.indexCount / 3; ++p) {
    if (p == hit.primitive) continue;
    std::array<float, 3> of{};
    int same = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t j = 0; j < 3; ++j) {
        if (corner(p, k) != corner(hit.primitive, j)) continue;
        of[k] = weights[j];
        ++same;
        break;
      }
    }
    if (same == 3) return {hit.object, p, of[1], of[2], hit.distance};
  }
  return {};
}

Differences compare(const Seen& seen, const scene::Camera& camera) {
  seen.raster.drawGBuffer(seen.gbuffer, camera, seen.moment.lighting);
  gl::testContext().check("the G-buffer");
  const std::vector<float> diffuse = raster::readRgba(seen.gbuffer.diffuse);
  const std::vector<float> normal = raster::readRgba(seen.gbuffer.normal);
  const std::vector<std::uint32_t> ids = raster::readIds(seen.gbuffer.object);
  const std::vector<float> depth = raster::readDepth(seen.gbuffer.depth);

  // The same samples by Embree
  std::vector<trace::Ray> rays;
  const Vec3 forward = camera.forward();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      trace::Ray ray;
      ray.origin = camera.eye();
      ray.direction = scene::rayDirection(camera, kWidth, kHeight, static_cast<float>(x) + 0.5f,
                                          static_cast<float>(y) + 0.5f);
      ray.near = camera.nearMetres / glm::dot(ray.direction, forward);
      rays.push_back(ray);
    }
  }
  std::vector<trace::Hit> hits(rays.size());
  seen.trace.intersect(rays, hits, true);
  const float spread = scene::pixelSpreadRad(camera, kHeight);

  const auto zOf = [&](std::size_t i) {
    return hits[i].miss() ? 0.0f : hits[i].distance * glm::dot(rays[i].direction, forward);
  };
  Differences found;
  for (int y = 1; y + 1 < kHeight; ++y) {
    for (int x = 1; x + 1 < kWidth; ++x) {
      // Silhouettes: another object, or a jump in depth, among the neighbours
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
      ++found.compared;
      if (static_cast<int>(ids[i]) != hits[i].object + 1) {
        ++found.id;
        continue;
      }
      const Vec3 drawn(diffuse[4 * i], diffuse[4 * i + 1], diffuse[4 * i + 2]);
      Vec3 expected = seen.moment.lighting.environment->radiance(rays[i].direction);
      if (!hits[i].miss()) {
        const auto shade = [&](const trace::Hit& hit) {
          return frame::shadeSurface(seen.moment.scene, seen.moment.geometry, seen.moment.lighting,
                                     hit.object, hit.primitive, hit.u, hit.v,
                                     rays[i].origin + hit.distance * rays[i].direction,
                                     rays[i].direction, spread * hit.distance);
        };
        const frame::SurfacePoint point = shade(hits[i]);
        expected = point.diffuse;
        const float z = camera.nearMetres / depth[i];
        found.depth += std::abs(z - zOf(i)) > 1e-4f * zOf(i) ? 1 : 0;
        const Vec3 n(normal[4 * i], normal[4 * i + 1], normal[4 * i + 2]);
        found.normal += glm::dot(n, point.normal) < 0.9999f ? 1 : 0;
        found.specular += std::abs(diffuse[4 * i + 3] - point.specularLevel) > 0.005f ||
                                  std::abs(normal[4 * i + 3] - point.glossiness) > 0.005f
                              ? 1
                              : 0;
        if (!agrees(drawn, expected)) {
          const trace::Hit twin = twinOf(seen.moment.geometry, hits[i]);
          if (!twin.miss() && agrees(drawn, shade(twin).diffuse)) {
            ++found.twins;
            continue;
          }
        }
      }
      found.diffuse += agrees(drawn, expected) ? 0 : 1;
      found.worstDiffuse =
          std::max(found.worstDiffuse, static_cast<double>(glm::length(drawn - expected)));
    }
  }

  // What its mirrors see
  raster::GBufferCopy copy;
  raster::readBack(seen.gbuffer, true, copy);
  const methods::ReflectiveSamples samples = methods::collectReflective(copy, camera, seen.trace);
  std::vector<Vec3> radiance(samples.points.size());
  found.reflected =
      trace::reflectedRadiance(seen.trace, seen.moment.lighting, spread, samples.points,
                               {.rays = 2, .bounces = 2}, true, radiance);
  return found;
}

/// At least 99.9% of the samples off silhouettes agree.
void expectAgreement(const std::string& name, const Differences& found) {
  std::printf(
      "%-22s compared %d; differ: id %d, depth %d, normal %d, s or g %d, diffuse %d "
      "(worst %.4f); coincident layers %d\n",
      name.c_str(), found.compared, found.id, found.depth, found.normal, found.specular,
      found.diffuse, found.worstDiffuse, found.twins);
  const int allowed = found.compared / 1000;
  EXPECT_GT(found.compared, kWidth * kHeight / 3) << name;
  EXPECT_LE(found.id, allowed) << name;
  EXPECT_LE(found.depth, allowed) << name;
  EXPECT_LE(found.normal, allowed) << name;
  EXPECT_LE(found.specular, allowed) << name;
  EXPECT_LE(found.diffuse, allowed) << name;
  EXPECT_EQ(found.reflected.refused, 0u) << name;
  EXPECT_EQ(found.reflected.notFinite, 0u) << name;
}

TEST(Agreement, OfLightsOfAllTypes) {
  gl::testContext();
  const Subject subject = codeScene();
  const test::Moment moment(subject.scene);
  raster::SceneRaster raster(subject.scene, moment.geometry);
  raster::GBuffer gbuffer = raster.makeGBuffer({kWidth, kHeight, 1, false});
  const trace::TraceScene trace(subject.scene, moment.geometry, trace::BvhPolicy::Static);
  expectAgreement("code", compare({moment, raster, gbuffer, trace}, subject.camera));
}

class SceneAgreement : public testing::TestWithParam<SceneFile> {
 protected:
  static void SetUpTestSuite() {
    const std::string command = "'" + (kRoot / "scripts/prepare_assets").string() + "' -q";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
};

TEST_P(SceneAgreement, OffSilhouettesAlongThePaths) {
  gl::testContext();
  const SceneFile& file = GetParam();
  scene::Scene scene = scene::loadScene(kRoot / "scenes" / (std::string(file.name) + ".json"));
  scene.bake.rays = 8;
  scene.bake.bounces = 1;
  // OpenGL draws the triangles of implicit surfaces: Embree, too, here
  for (scene::Mesh& mesh : scene.meshes) mesh.surface = nullptr;
  test::Moment moment(scene);
  trace::bakeVertices(scene, moment.geometry, *moment.lighting.environment, {});
  raster::SceneRaster raster(scene, moment.geometry);
  raster::GBuffer gbuffer = raster.makeGBuffer({kWidth, kHeight, 1, false});
  trace::TraceScene trace(scene, moment.geometry, trace::BvhPolicy::Static);
  for (const char* name : file.paths) {
    const std::unique_ptr<scene::CameraPath> path =
        scene::loadPath(kRoot / "paths" / (std::string(name) + ".json"), scene);
    for (int number : {1, 1 + path->count() / 3, path->count()}) {
      const scene::PathFrame frame = path->frame(number);
      if (file.moves) {
        const scene::Pose pose = scene::poseAt(scene, frame.timeSeconds);
        const std::vector<int> changed = frame::updateGeometry(moment.geometry, scene, pose);
        moment.lighting = frame::makeLighting(scene, pose, moment.lighting.environment);
        raster.update(moment.geometry, changed);
        trace.update(changed);
        EXPECT_EQ(number > 1, !changed.empty());
      }
      expectAgreement(std::string(name) + " " + std::to_string(number),
                      compare({moment, raster, gbuffer, trace}, frame.camera));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SceneAgreement, testing::ValuesIn(sceneFiles()),
                         [](const auto& each) { return std::string(each.param.name); });

/// Every description in scenes/ is compared above.
TEST(Agreement, NoSceneIsForgotten) {
  std::vector<std::string> there;
  for (const auto& entry : std::filesystem::directory_iterator(kRoot / "scenes"))
    if (entry.path().extension() == ".json") there.push_back(entry.path().stem().string());
  std::vector<std::string> compared;
  for (const SceneFile& file : sceneFiles()) compared.emplace_back(file.name);
  EXPECT_THAT(compared, testing::UnorderedElementsAreArray(there));
}

TEST(Agreement, TracedConvergesToReferenceOnMirrors) {
  gl::Context& context = gl::testContext();
  Subject subject = codeScene();
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
