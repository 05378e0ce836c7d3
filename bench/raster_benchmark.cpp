// G-buffer, composite and cube map at 512x512 with 2x2 samples, each between two runs of a fixed
// calibration (a full-screen fill by GL, a loop by the CPU), so that figures of different days and
// hosts can be compared: `ratio` = time / fill_ms; busy_ms is
// what all threads worked. CATOPTRIC_SCENE names a scene file and
// CATOPTRIC_PATH a camera path through it; without them a synthetic room of 286k triangles.
// CATOPTRIC_DEVICE chooses the GL device.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <vector>

#include "core/clock.h"
#include "frame/test_scenes.h"
#include "gl/test_context.h"
#include "raster/scene_raster.h"
#include "scene/animate.h"
#include "scene/loader.h"

namespace catoptric {
namespace {

using test::SceneBuilder;
using test::translation;

constexpr int kSize = 512;
constexpr int kSamples = 2;

/// 25 reflective and 12 diffuse objects in a room of fine walls: 286k triangles.
scene::Scene syntheticRoom() {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.0f));
  const int wall = builder.diffuse(Vec3(0.7f, 0.68f, 0.6f));
  const int grey = builder.diffuse(Vec3(0.4f));
  const int mirror = builder.reflective(0.8f);
  const int glossy = builder.reflective(0.3f, 0.3f, Vec3(0.6f, 0.2f, 0.1f));

  // A checkered texture on the walls
  scene::Texture checker;
  checker.name = "checker";
  for (int size = 512; size >= 1; size /= 2) {
    scene::MipLevel level{size, size, {}};
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const bool light = size < 16 || ((x * 16 / size) + (y * 16 / size)) % 2 == 0;
        const auto value = static_cast<std::uint8_t>(size < 16 ? 170 : (light ? 220 : 120));
        level.rgba.insert(level.rgba.end(), {value, value, value, 255});
      }
    }
    checker.levels.push_back(std::move(level));
  }
  builder.scene().textures.push_back(std::move(checker));
  builder.scene().materials[wall].baseColorTexture.texture = 0;

  scene::BoxShape box;
  box.size = Vec3(6.0f, 2.6f, 5.0f);
  box.segments = glm::ivec3(64);
  box.inward = true;
  builder.add(scene::makeBox(box, scene::UvMode::Metres), wall);
  for (int i = 0; i < 37; ++i) {
    const Vec3 place(-2.6f + 0.65f * static_cast<float>(i % 9),
                     -1.0f + 0.35f * static_cast<float>(i % 5),
                     -2.0f + 1.0f * static_cast<float>(i / 9));
    const int material = i % 3 == 0 ? grey : (i % 3 == 1 ? mirror : glossy);
    builder.add(i % 2 == 0 ? scene::makeSphere(0.3f, 64, 50, scene::UvMode::Unit)
                           : scene::makeTorus(0.22f, 0.08f, 64, 50, scene::UvMode::Unit),
                material, translation(place));
  }
  scene::Light lamp;
  lamp.position = Vec3(0.0f, 1.1f, 0.0f);
  lamp.intensity = Vec3(4.0f);
  builder.scene().lights.push_back(lamp);
  builder.scene().ambient = Vec3(0.1f);
  return builder.scene();
}

const char* environmentValue(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

struct World {
  gl::Context& context = gl::testContext();
  scene::Scene scene;
  frame::Geometry geometry;
  frame::Lighting lighting;
  std::unique_ptr<raster::SceneRaster> raster;
  raster::GBuffer gbuffer;
  gl::Texture frame;
  std::vector<scene::Camera> cameras;
  gl::Texture fillTarget = gl::Texture::make2D("calibration", GL_RGBA32F, 1024, 1024);
  gl::Framebuffer fillFramebuffer{"calibration", {{fillTarget}}};
  gl::Program fill = gl::Program::fullScreen("calibration", "gl/testdata/calibration.frag");

  World() {
    const char* file = environmentValue("CATOPTRIC_SCENE");
    scene = file != nullptr ? scene::loadScene(file) : syntheticRoom();
    const scene::Pose pose = scene::poseAt(scene, 0.0);
    geometry = frame::makeGeometry(scene, pose);
    // A bake's variants without its rays
    if (scene.bake.mode != scene::BakeMode::None) {
      for (frame::VertexAttributes& v : geometry.attributes) {
        v.bake = scene.bake.mode == scene::BakeMode::Full ? Vec4(0.6f, 0.5f, 0.4f, 0.0f)
                                                          : Vec4(0.0f, 0.0f, 0.0f, 0.7f);
      }
    }
    lighting = frame::makeLighting(scene, pose,
                                   std::make_shared<frame::EnvironmentLight>(scene.environment));
    const std::int64_t start = nowNs();
    raster = std::make_unique<raster::SceneRaster>(scene, geometry);
    context.finish("upload");
    const double upload = static_cast<double>(nowNs() - start) * 1e-6;
    gbuffer = raster->makeGBuffer({kSize, kSize, kSamples, false});
    frame = gl::Texture::make2D("frame", GL_RGBA32F, kSize, kSize);
    if (const char* path = environmentValue("CATOPTRIC_PATH")) {
      const std::unique_ptr<scene::CameraPath> frames = scene::loadPath(path, scene);
      for (int i = 0; i < 6; ++i) {
        cameras.push_back(frames->frame(1 + i * (frames->count() - 1) / 6).camera);
      }
    } else if (file != nullptr) {
      cameras.push_back(scene::defaultPath(scene)->frame(1).camera);
    } else {
      cameras.push_back(scene::lookAt({2.7f, 0.6f, 2.3f}, {-0.5f, -0.2f, -0.3f}, {0, 1, 0}, 1.0f));
      cameras.push_back(scene::lookAt({0.0f, 0.9f, 2.3f}, {0.0f, -0.3f, 0.0f}, {0, 1, 0}, 1.2f));
    }
    std::fprintf(stderr, "%s: %zu triangles, %zu objects, upload %.1f ms, %s\n",
                 file != nullptr ? file : "synthetic room", geometry.triangleCount(),
                 geometry.objects.size(), upload, context.info().renderer.c_str());
  }

  /// Milliseconds of a fixed fill by GL.
  double calibrateGl() {
    const std::int64_t start = nowNs();
    fillFramebuffer.bind();
    fill.use();
    gl::drawFullScreenTriangle();
    context.finish("calibration");
    return static_cast<double>(nowNs() - start) * 1e-6;
  }
  /// Milliseconds of a fixed loop on one core.
  static double calibrateCpu() {
    const std::int64_t start = nowNs();
    float x = 0.5f;
    for (int i = 0; i < 2'000'000; ++i) x = 3.9f * x * (1.0f - x);
    benchmark::DoNotOptimize(x);
    return static_cast<double>(nowNs() - start) * 1e-6;
  }
};

World& world() {
  static World instance;
  return instance;
}

/// Milliseconds that all threads of this process have run: less disturbed by other programs than
/// the clock on the wall.
double processMs() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Times `body` between calibrations.
template <class Body>
void timed(benchmark::State& state, Body&& body) {
  World& w = world();
  body();
  w.context.finish("warm-up");
  w.calibrateGl();
  double gl = 0.0;
  double cpu = 0.0;
  double total = 0.0;
  double busy = 0.0;
  for (auto _ : state) {
    gl += w.calibrateGl();
    cpu += World::calibrateCpu();
    const double busyStart = processMs();
    const std::int64_t start = nowNs();
    body();
    w.context.finish("benchmark");
    const double seconds = secondsSince(start);
    busy += processMs() - busyStart;
    gl += w.calibrateGl();
    total += seconds * 1e3;
    state.SetIterationTime(seconds);
  }
  const auto n = static_cast<double>(state.iterations());
  state.counters["busy_ms"] = busy / n;
  state.counters["fill_ms"] = gl / (2.0 * n);
  state.counters["cpu_ms"] = cpu / n;
  state.counters["ratio"] = total / (gl / 2.0);
}

void gbuffer(benchmark::State& state) {
  World& w = world();
  const scene::Camera& camera =
      w.cameras[static_cast<std::size_t>(state.range(0)) % w.cameras.size()];
  raster::DrawStatistics statistics;
  timed(state, [&] { statistics = w.raster->drawGBuffer(w.gbuffer, camera, w.lighting); });
  state.counters["drawn"] = static_cast<double>(statistics.triangles);
  state.counters["culled"] = static_cast<double>(statistics.culledTriangles);
}

void composite(benchmark::State& state) {
  World& w = world();
  raster::CompositeOptions options;
  options.fresnelSchlick = state.range(0) != 0;
  timed(state, [&] { w.raster->composite(w.gbuffer, w.cameras[0], options, w.frame); });
}

void cubeMap(benchmark::State& state) {
  World& w = world();
  timed(state, [&] {
    const gl::Texture cube = w.raster->drawCubeMap(w.geometry.bounds.centre(), 256, w.lighting);
  });
}

void readback(benchmark::State& state) {
  World& w = world();
  timed(state, [&] { benchmark::DoNotOptimize(raster::readRgba(w.frame)); });
}

BENCHMARK(gbuffer)->DenseRange(0, 5)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(composite)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(cubeMap)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(readback)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace catoptric

BENCHMARK_MAIN();
