// Look-ups of rays near a point for each second of CPU time, and whole updates of a virtual object.
// `calibration_ms`: a fixed loop's CPU time in the same run, to compare figures of different days
// and hosts.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

#include "core/parallel.h"
#include "methods/perturbation/ray_octree.h"
#include "methods/perturbation/test_ball.h"
#include "methods/perturbation/virtual_objects.h"
#include "scene/implicit/gradient.h"
#include "scene/implicit/surface.h"
#include "scene/shapes/shapes.h"

namespace catoptric::methods::perturbation {
namespace {

using implicit::Surface;

/// 80 x 60 samples of the paper's vase.
struct Setup {
  Surface vase = implicit::vaseSurface();
  glm::dvec3 eye{0.5, 1.6, 4.0};
  std::vector<SampleRay> rays;
  std::vector<Neighbours> neighbours;
  std::vector<glm::dvec3> points;

  Setup() {
    constexpr int kWidth = 80;
    constexpr int kHeight = 60;
    std::vector<std::uint32_t> rayAt(std::size_t{kWidth * kHeight}, kNoRay);
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const glm::dvec3 target(2.4 * (i % kWidth + 0.5) / kWidth - 1.2,
                              2.2 * (0.5 + i / kWidth) / kHeight - 0.1, 0.0);
      const glm::dvec3 d = glm::normalize(target - eye);
      const auto hit = implicit::firstHit(vase, {eye, d});
      if (hit.status != implicit::HitStatus::Hit) continue;
      const glm::dvec3 x = eye + hit.t * d;
      const auto n = implicit::normalAt(vase, x);
      if (!n) continue;
      rayAt[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(rays.size());
      rays.push_back({x, glm::reflect(d, *n)});
    }
    neighbours = gridNeighbours(kWidth, kHeight, rayAt);
    constexpr int kPoints = 100'000;
    for (int i = 0; i < kPoints; ++i) {
      const double t = 6.28 * i / kPoints;
      points.emplace_back(1.5 * std::cos(t), 1.0 + 0.5 * std::sin(40 * t), 2.0 + std::sin(t));
    }
  }
};
const Setup& setup() {
  static const Setup made;
  return made;
}

void nearestRays(benchmark::State& state) {
  const Setup& s = setup();
  RayOctree::Settings settings;
  settings.k = static_cast<std::size_t>(state.range(0));
  const RayOctree tree(s.rays, {-3, -1, -1}, {3, 4, 5}, settings);
  std::vector<NearRay> found;
  for (auto _ : state) {
    RayOctree::Cursor cursor;
    for (const glm::dvec3& p : s.points) {
      tree.nearest(p, cursor, found);
      benchmark::DoNotOptimize(found.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.points.size()));
}
BENCHMARK(nearestRays)->Arg(1)->Arg(5);

void reflections(benchmark::State& state) {
  const Setup& s = setup();
  const RayOctree tree(s.rays, {-3, -1, -1}, {3, 4, 5}, {}, s.neighbours);
  std::vector<NearRay> found;
  std::size_t count = 0;
  for (auto _ : state) {
    RayOctree::Cursor cursor;
    for (const glm::dvec3& p : s.points) {
      tree.reflections(p, cursor, found);
      count += found.size();
      benchmark::DoNotOptimize(found.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.points.size()));
  state.counters["reflections"] =
      static_cast<double>(count) /
      (static_cast<double>(state.iterations()) * static_cast<double>(s.points.size()));
}
BENCHMARK(reflections);

void octree(benchmark::State& state) {
  for (auto _ : state) {
    const RayOctree tree(setup().rays, {-3, -1, -1}, {3, 4, 5}, {});
    benchmark::DoNotOptimize(&tree);
  }
}
BENCHMARK(octree)->Unit(benchmark::kMillisecond);

void vaseHits(benchmark::State& state) {
  const Setup& s = setup();
  for (auto _ : state) {
    for (const SampleRay& ray : s.rays) {
      benchmark::DoNotOptimize(
          implicit::firstHit(s.vase, {s.eye, glm::normalize(ray.origin - s.eye)}));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.rays.size()));
}
BENCHMARK(vaseHits);

/// Milliseconds of a fixed loop on one core, as in raster_benchmark.
double calibrate() {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  float x = 0.5f;
  for (int i = 0; i < 2'000'000; ++i) x = 3.9f * x * (1.0f - x);
  benchmark::DoNotOptimize(x);
  return now() - start;
}

/// All that follows a move of an object of so many vertices before the vase, but the upload: 640 x
/// 480, a path every 16th pixel, order and tessellation by default. The first iteration makes the
/// mesh's connectivity.
void updates(benchmark::State& state) {
  const BallBeforeVase stage(
      static_cast<int>(std::sqrt(0.5 * static_cast<double>(state.range(0)))));
  const Reflector reflector({&stage.turn, 1}, nullptr, stage.around, stage.view, {});
  setThreadCount(2);
  TriangleCounts counts;
  Connectivity known;
  VirtualTriangles made;
  double calibration = std::numeric_limits<double>::infinity();
  for (auto _ : state) {
    counts = {};
    virtualTriangles(stage.geometry, 0, reflector, false, stage.view, Order::Auto, {}, known,
                     counts, made);
    benchmark::DoNotOptimize(made.indices.data());
    state.PauseTiming();
    calibration = std::min(calibration, calibrate());
    state.ResumeTiming();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(counts.vertices));
  state.counters["vertices"] = static_cast<double>(counts.vertices);
  state.counters["calibration_ms"] = calibration;
}
BENCHMARK(updates)
    ->RangeMultiplier(4)
    ->Range(2'000, 128'000)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace catoptric::methods::perturbation

BENCHMARK_MAIN();
