// Rays per second of TraceScene against a bare loop over Embree's packets, the four policies, and
// the bake. CATOPTRIC_SCENE names a scene file, CATOPTRIC_VIEW
// eye and target in it ("2.5,1.6,2.5,0,1,0"); without it a room of 21 spheres, 282k triangles.
#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/clock.h"
#include "core/parallel.h"
#include "frame/test_scenes.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "scene/loader.h"
#include "trace/bake/bake.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/reflect.h"

namespace catoptric {
namespace {

using test::SceneBuilder;
using test::translation;
using trace::BvhPolicy;

scene::Scene makeScene() {
  if (const char* file = std::getenv("CATOPTRIC_SCENE"); file != nullptr && *file != '\0') {
    return scene::loadScene(file);
  }
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(1.0f));
  const int grey = builder.diffuse(Vec3(0.6f));
  const int mirror = builder.reflective(0.8f);
  scene::BoxShape box;
  box.size = Vec3(10.0f, 4.0f, 8.0f);
  box.segments = glm::ivec3(64);
  box.inward = true;
  builder.add(scene::makeBox(box, scene::UvMode::Unit), grey);
  for (int i = 0; i < 21; ++i) {
    const auto x = static_cast<float>(i % 7);
    const auto z = static_cast<float>(i / 7);
    builder.add(scene::makeSphere(0.5f, 96, 58, scene::UvMode::Unit), i % 2 == 0 ? mirror : grey,
                translation({-3.9f + 1.3f * x, -1.4f + 0.3f * z, -2.4f + 1.8f * z}));
  }
  return builder.scene();
}

/// Scene, reflected rays of a camera's view in the order that methods trace them.
struct World {
  scene::Scene scene = makeScene();
  frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
  std::vector<trace::Ray> rays;

  World() {
    const trace::TraceScene trace(scene, geometry, BvhPolicy::Static);
    const Vec3 centre = geometry.bounds.centre();
    const Vec3 half = 0.5f * (geometry.bounds.max - geometry.bounds.min);
    std::array<float, 6> view{};
    const Vec3 outer = centre + half * Vec3(0.8f, 0.5f, 0.8f);
    const char* text = std::getenv("CATOPTRIC_VIEW");
    const bool given = text != nullptr && std::sscanf(text, "%f,%f,%f,%f,%f,%f", &view[0], &view[1],
                                                      &view[2], &view[3], &view[4], &view[5]) == 6;
    const Vec3 eye = given ? Vec3(view[0], view[1], view[2]) : outer;
    const Vec3 target = given ? Vec3(view[3], view[4], view[5]) : centre;
    const scene::Camera camera = scene::lookAt(eye, target, {0.0f, 1.0f, 0.0f}, radians(60.0f));
    constexpr int kSize = 1024;
    std::vector<trace::Ray> primary;
    for (int tile = 0; tile < kSize * kSize / 64; ++tile) {
      const int x0 = tile % (kSize / 8) * 8;
      const int y0 = tile / (kSize / 8) * 8;
      for (int k = 0; k < 64; ++k) {
        const int x = x0 + k % 4 + k / 32 * 4;
        const int y = y0 + k / 4 % 8;
        primary.push_back(
            {camera.eye(), scene::rayDirection(camera, kSize, kSize, static_cast<float>(x) + 0.5f,
                                               static_cast<float>(y) + 0.5f)});
      }
    }
    std::vector<trace::Hit> hits(primary.size());
    trace.intersect(primary, hits, true);
    for (std::size_t i = 0; i < primary.size(); ++i) {
      const trace::Hit& hit = hits[i];
      if (hit.miss()) continue;
      const std::uint32_t* t =
          &geometry.indices[geometry.objects[hit.object].firstIndex + 3 * hit.primitive];
      Vec3 normal = (1.0f - hit.u - hit.v) * geometry.attributes[t[0]].normal +
                    hit.u * geometry.attributes[t[1]].normal +
                    hit.v * geometry.attributes[t[2]].normal;
      normal = normalizedOr(normal, Vec3(0.0f, 1.0f, 0.0f));
      if (glm::dot(normal, primary[i].direction) > 0.0f) normal = -normal;
      const Vec3 position = primary[i].origin + hit.distance * primary[i].direction;
      trace::Ray ray;
      ray.origin = position + normal * trace::rayOffset(position, hit.distance);
      ray.direction = glm::reflect(primary[i].direction, normal);
      rays.push_back(ray);
    }
    rays.resize(rays.size() / 16 * 16);
  }
};

World& world() {
  static World instance;
  return instance;
}

void countRays(benchmark::State& state) {
  state.counters["rays/s"] = benchmark::Counter(
      static_cast<double>(world().rays.size()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate);
}

/// Embree and nothing else: rays packed beforehand, hits left in the packets.
class Bare {
 public:
  Bare() {
    const World& w = world();
    device_ = rtcNewDevice("set_affinity=0,start_threads=0");
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    for (std::size_t i = 0; i < w.geometry.objects.size(); ++i) {
      const frame::ObjectRange& range = w.geometry.objects[i];
      RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                 w.geometry.positions.data(), 0, sizeof(Vec3),
                                 w.geometry.vertexCount());
      rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                 w.geometry.indices.data() + range.firstIndex, 0, 12,
                                 range.indexCount / 3);
      rtcCommitGeometry(g);
      rtcAttachGeometryByID(scene_, g, static_cast<unsigned>(i));
      rtcReleaseGeometry(g);
    }
    rtcCommitScene(scene_);
    packets_.resize(w.rays.size() / 8);
    for (std::size_t r = 0; r < w.rays.size(); ++r) {
      RTCRay8& p = packets_[r / 8];
      const std::size_t i = r % 8;
      p.org_x[i] = w.rays[r].origin.x;
      p.org_y[i] = w.rays[r].origin.y;
      p.org_z[i] = w.rays[r].origin.z;
      p.dir_x[i] = w.rays[r].direction.x;
      p.dir_y[i] = w.rays[r].direction.y;
      p.dir_z[i] = w.rays[r].direction.z;
      p.tnear[i] = 0.0f;
      p.tfar[i] = std::numeric_limits<float>::infinity();
      p.time[i] = 0.0f;
      p.mask[i] = 0xFFFFFFFFu;
      p.id[i] = 0;
      p.flags[i] = 0;
    }
    results_.resize(packets_.size());
  }
  ~Bare() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  void trace() {
    parallelFor(packets_.size(), 512, [&](std::size_t begin, std::size_t end) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      alignas(32) std::array<int, 8> valid;
      valid.fill(-1);
      for (std::size_t i = begin; i < end; ++i) {
        RTCRayHit8& packet = results_[i];
        packet.ray = packets_[i];
        for (int k = 0; k < 8; ++k) packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect8(valid.data(), scene_, &context, &packet);
      }
    });
  }

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  std::vector<RTCRay8> packets_;
  std::vector<RTCRayHit8> results_;
};

/// A B B A: the machine drifts, so only figures of one run and interleaved are compared.
void BM_TracedAgainstBare(benchmark::State& state) {
  static Bare bare;
  static trace::TraceScene traced(world().scene, world().geometry, BvhPolicy::Static);
  std::vector<trace::Hit> hits(world().rays.size());
  double bareSeconds = 0.0;
  double tracedSeconds = 0.0;
  const auto timed = [](double& sum, auto&& body) {
    const std::int64_t start = nowNs();
    body();
    sum += secondsSince(start);
  };
  const auto runBare = [&] { timed(bareSeconds, [&] { bare.trace(); }); };
  const auto runTraced = [&] {
    timed(tracedSeconds, [&] { traced.intersect(world().rays, hits, true); });
  };
  runBare();
  runTraced();
  bareSeconds = tracedSeconds = 0.0;
  for (auto unused : state) {
    (void)unused;
    runBare();
    runTraced();
    runTraced();
    runBare();
  }
  const double rays =
      2.0 * static_cast<double>(world().rays.size()) * static_cast<double>(state.iterations());
  state.counters["bare_rays/s"] = rays / bareSeconds;
  state.counters["traced_rays/s"] = rays / tracedSeconds;
  state.counters["traced/bare"] = bareSeconds / tracedSeconds;
}
BENCHMARK(BM_TracedAgainstBare)->Unit(benchmark::kMillisecond)->UseRealTime()->MinTime(3.0);

void BM_Rays(benchmark::State& state, BvhPolicy policy, bool robust, bool coherent) {
  trace::TraceOptions options;
  options.robust = robust;
  const trace::TraceScene trace(world().scene, world().geometry, policy, options);
  std::vector<trace::Hit> hits(world().rays.size());
  for (auto unused : state) {
    (void)unused;
    trace.intersect(world().rays, hits, coherent);
  }
  countRays(state);
}
BENCHMARK_CAPTURE(BM_Rays, static, BvhPolicy::Static, false, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Rays, static_robust, BvhPolicy::Static, true, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Rays, static_incoherent_flag, BvhPolicy::Static, false, false)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Rays, refit, BvhPolicy::Refit, false, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Rays, rebuild_low, BvhPolicy::RebuildLow, false, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Rays, rebuild_medium, BvhPolicy::RebuildMedium, false, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Rays of a camera at one implicit surface that fills the view: hits and misses.
void BM_Implicit(benchmark::State& state, const implicit::Surface& surface) {
  SceneBuilder builder;
  builder.add(scene::makeImplicit(surface, 24, scene::UvMode::Unit), builder.reflective(1.0f));
  const frame::Geometry geometry =
      frame::makeGeometry(builder.scene(), scene::poseAt(builder.scene(), 0.0));
  const trace::TraceScene trace(builder.scene(), geometry, BvhPolicy::Static);
  const Vec3 centre = geometry.bounds.centre();
  const scene::Camera camera =
      scene::lookAt(centre + geometry.bounds.diameter() * Vec3(0.3f, 0.5f, 1.0f), centre,
                    {0.0f, 1.0f, 0.0f}, radians(45.0f));
  constexpr int kSize = 256;
  std::vector<trace::Ray> rays;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      rays.push_back(
          {camera.eye(), scene::rayDirection(camera, kSize, kSize, static_cast<float>(x) + 0.5f,
                                             static_cast<float>(y) + 0.5f)});
    }
  }
  std::vector<trace::Hit> hits(rays.size());
  for (auto _ : state) trace.intersectSerial(rays, hits, true);
  const auto found =
      std::count_if(hits.begin(), hits.end(), [](const trace::Hit& hit) { return !hit.miss(); });
  state.counters["hit"] = static_cast<double>(found) / static_cast<double>(rays.size());
  state.counters["rays"] = benchmark::Counter(static_cast<double>(rays.size()),
                                              benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK_CAPTURE(BM_Implicit, sphere, implicit::sphereSurface(0.5));
BENCHMARK_CAPTURE(BM_Implicit, torus, implicit::torusSurface(0.5, 0.2));
BENCHMARK_CAPTURE(BM_Implicit, vase, implicit::vaseSurface());
BENCHMARK_CAPTURE(BM_Implicit, metaballs,
                  implicit::metaballsSurface({{-0.3, 0, 0, 0.3}, {0.3, 0, 0, 0.3}}, 2.0));

void BM_Build(benchmark::State& state, BvhPolicy policy) {
  for (auto unused : state) {
    (void)unused;
    const trace::TraceScene trace(world().scene, world().geometry, policy);
    benchmark::DoNotOptimize(trace.memoryBytes());
  }
}
BENCHMARK_CAPTURE(BM_Build, static, BvhPolicy::Static)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Build, refit, BvhPolicy::Refit)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_Update(benchmark::State& state, BvhPolicy policy) {
  // Every object counts as moving and changed.
  frame::Geometry geometry = world().geometry;
  std::vector<int> all;
  for (std::size_t i = 0; i < geometry.objects.size(); ++i) {
    geometry.objects[i].moving = true;
    all.push_back(static_cast<int>(i));
  }
  trace::TraceScene trace(world().scene, geometry, policy);
  trace.update(all);
  for (auto unused : state) {
    (void)unused;
    trace.update(all);
  }
}
BENCHMARK_CAPTURE(BM_Update, refit, BvhPolicy::Refit)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Update, rebuild_low, BvhPolicy::RebuildLow)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Update, rebuild_medium, BvhPolicy::RebuildMedium)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void BM_Bake(benchmark::State& state, scene::BakeMode mode) {
  scene::Scene scene = world().scene;
  scene.bake.mode = mode;
  const frame::EnvironmentLight environment(scene.environment);
  trace::BakeReport report;
  for (auto unused : state) {
    (void)unused;
    frame::Geometry geometry = world().geometry;
    report = trace::bakeVertices(scene, geometry, environment, {});
  }
  state.counters["points"] = static_cast<double>(report.points);
  state.counters["enclosed"] = static_cast<double>(report.enclosed);
  state.counters["rays"] = static_cast<double>(report.rays);
}
BENCHMARK_CAPTURE(BM_Bake, ambient_occlusion, scene::BakeMode::AmbientOcclusion)
    ->Unit(benchmark::kSecond)
    ->UseRealTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(BM_Bake, full, scene::BakeMode::Full)
    ->Unit(benchmark::kSecond)
    ->UseRealTime()
    ->Iterations(1);

}  // namespace
}  // namespace catoptric

BENCHMARK_MAIN();
