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
#include "methods/testing/gl_harness.h"
#include "scene/loader.h"

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
      {"pillars", {"pillars"}},
      {"facade", {"facade"}},
      {"gargoyle_plane", {"gargoyle_plane"}},
      {"gargoyle_teapot", {"gargoyle_teapot"}},
      {"glossy_complex", {"glossy_complex"}, true},
      {"glossy_text", {"glossy_text"}},
      {"ground_morph", {"ground_morph"}},
      {"near_far", {"near_far"}},
      {"nine_balls", {"nine_balls"}, true},
      {"nine_teapots", {"nine_teapots"}, true},
      {"statue_table", {"statue_table"}},
      {"two_figures", {"two_figures"}, true},
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

const methods::RunSettings kSettings = test::framesOf(kWidth, kHeight, 1);

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

/// A view's camera rays, one a sample, and where Embree's triangles meet them.
struct Seen {
  std::vector<trace::Ray> rays;
  std::vector<trace::Hit> hits;
  std::vector<float> z;  ///< along the view direction, 0: nothing
};

Seen seenByEmbree(const trace::TraceScene& trace, const scene::Camera& camera) {
  Seen seen;
  const Vec3 forward = camera.forward();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      trace::Ray ray;
      ray.origin = camera.eye();
      ray.direction = scene::rayDirection(camera, kWidth, kHeight, static_cast<float>(x) + 0.5f,
                                          static_cast<float>(y) + 0.5f);
      ray.near = camera.nearMetres / glm::dot(ray.direction, forward);
      seen.rays.push_back(ray);
    }
  }
  seen.hits.resize(seen.rays.size());
  trace.intersect(seen.rays, seen.hits, true);
  for (std::size_t i = 0; i < seen.hits.size(); ++i) {
    const trace::Hit& hit = seen.hits[i];
    seen.z.push_back(hit.miss() ? 0.0f : hit.distance * glm::dot(seen.rays[i].direction, forward));
  }
  return seen;
}

/// Whether another object, or a jump in depth, is among a sample's neighbours.
bool isSilhouette(const Seen& seen, int x, int y) {
  const std::size_t i = at(x, y);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const std::size_t n = at(x + dx, y + dy);
      if (seen.hits[n].object != seen.hits[i].object ||
          std::abs(seen.z[n] - seen.z[i]) > 0.1f * seen.z[i])
        return true;
    }
  }
  return false;
}

/// The drawn samples of a view.
struct Drawn {
  std::vector<float> diffuse, normal, depth;
  std::vector<std::uint32_t> ids;

  explicit Drawn(const raster::GBuffer& gbuffer)
      : diffuse(raster::readRgba(gbuffer.diffuse)),
        normal(raster::readRgba(gbuffer.normal)),
        depth(raster::readDepth(gbuffer.depth)),
        ids(raster::readIds(gbuffer.object)) {}
};

/// Compares sample `i`, where both see the same object or none.
void compareSample(const test::GlStage& stage, const scene::Camera& camera, const Drawn& drawn,
                   const Seen& seen, std::size_t i, Differences& found) {
  const test::Moment& moment = stage.moment;
  const float spread = scene::pixelSpreadRad(camera, kHeight);
  const trace::Ray& ray = seen.rays[i];
  const Vec3 diffuse(drawn.diffuse[4 * i], drawn.diffuse[4 * i + 1], drawn.diffuse[4 * i + 2]);
  Vec3 expected = moment.lighting.environment->radiance(ray.direction);
  if (!seen.hits[i].miss()) {
    const auto shade = [&](const trace::Hit& hit) {
      return frame::shadeSurface(
          stage.scene, moment.geometry, moment.lighting, hit.object, hit.primitive, hit.u, hit.v,
          ray.origin + hit.distance * ray.direction, ray.direction, spread * hit.distance,
          frame::scatterPlace(static_cast<int>(i % kWidth), static_cast<int>(i / kWidth)));
    };
    const frame::SurfacePoint point = shade(seen.hits[i]);
    expected = point.diffuse;
    const float z = camera.nearMetres / drawn.depth[i];
    found.depth += std::abs(z - seen.z[i]) > 1e-4f * seen.z[i] ? 1 : 0;
    const Vec3 n(drawn.normal[4 * i], drawn.normal[4 * i + 1], drawn.normal[4 * i + 2]);
    found.normal += glm::dot(n, point.normal) < 0.9999f ? 1 : 0;
    found.specular +=
        std::abs(drawn.diffuse[4 * i + 3] - point.specularLevel) > 0.005f ||
                std::abs(raster::lobeOf(drawn.normal[4 * i + 3]).code - point.lobe.code) > 0.005f
            ? 1
            : 0;
    if (!agrees(diffuse, expected)) {
      const trace::Hit twin = twinOf(moment.geometry, seen.hits[i]);
      if (!twin.miss() && agrees(diffuse, shade(twin).diffuse)) {
        ++found.twins;
        return;
      }
    }
  }
  found.diffuse += agrees(diffuse, expected) ? 0 : 1;
  found.worstDiffuse =
      std::max(found.worstDiffuse, static_cast<double>(glm::length(diffuse - expected)));
}

Differences compare(test::GlStage& stage, const scene::Camera& camera) {
  stage.draw(camera);
  const Drawn drawn(stage.gbuffer);
  const Seen seen = seenByEmbree(stage.embree(), camera);
  Differences found;
  for (int y = 1; y + 1 < kHeight; ++y) {
    for (int x = 1; x + 1 < kWidth; ++x) {
      if (isSilhouette(seen, x, y)) continue;
      const std::size_t i = at(x, y);
      ++found.compared;
      if (static_cast<int>(drawn.ids[i]) != seen.hits[i].object + 1) {
        ++found.id;
      } else {
        compareSample(stage, camera, drawn, seen, i, found);
      }
    }
  }
  // What its mirrors see
  found.reflected = test::TracedSamples(stage, camera, {.rays = 2, .bounces = 2}).counts;
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
  const Subject subject = codeScene();
  test::GlStage stage(subject.scene, kSettings);
  expectAgreement("code", compare(stage, subject.camera));
}

class SceneAgreement : public testing::TestWithParam<SceneFile> {
 protected:
  static void SetUpTestSuite() {
    const std::string command = "'" + (kRoot / "scripts/prepare_assets").string() + "' -q";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
};

TEST_P(SceneAgreement, OffSilhouettesAlongThePaths) {
  const SceneFile& file = GetParam();
  scene::Scene scene = scene::loadScene(kRoot / "scenes" / (std::string(file.name) + ".json"));
  scene.bake.rays = 8;
  scene.bake.bounces = 1;
  // OpenGL draws the triangles of implicit surfaces: Embree, too, here
  for (scene::Mesh& mesh : scene.meshes) mesh.surface = nullptr;
  test::GlStage stage(scene, kSettings, true);
  stage.embree(trace::BvhPolicy::Static);
  for (const char* name : file.paths) {
    const std::unique_ptr<scene::CameraPath> path =
        scene::loadPath(kRoot / "paths" / (std::string(name) + ".json"), scene);
    for (int number : {1, 1 + path->count() / 3, path->count()}) {
      const scene::PathFrame frame = path->frame(number);
      if (file.moves) {
        const std::vector<int> changed = stage.moveTo(frame.timeSeconds);
        EXPECT_EQ(number > 1, !changed.empty());
      }
      expectAgreement(std::string(name) + " " + std::to_string(number),
                      compare(stage, frame.camera));
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
  Subject subject = codeScene();
  for (scene::Material& material : subject.scene.materials) material.roughness = 0.0f;
  test::GlStage stage(subject.scene, test::framesOf(kWidth, kHeight, 2));
  methods::FrameOutput output =
      test::GlMethod(stage, test::methodNamed("traced")).render(subject.camera);
  const std::vector<float> pixels = stage.composite(subject.camera);
  EXPECT_GT(output.counters["rays"], 1000u);
  EXPECT_EQ(output.counters["refused"], 0u);

  // The reference takes the very same samples: what differs are silhouettes, seen or mirrored.
  const methods::FrameOutput truth = test::renderOnCpu(
      test::methodNamed("reference"), R"({"max_standard_error": 0, "bounces": 1, "samples": 2})",
      stage.moment, subject.camera, stage.settings);
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
