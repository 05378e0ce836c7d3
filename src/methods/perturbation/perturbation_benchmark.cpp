// Evaluations of the bounce's formulas for each second of CPU time, all threads' together, of the
// look-up before them, and of whole updates of a virtual object. `calibration_ms`: a fixed loop's
// CPU time in the same run, to compare figures of different days and hosts.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>
#include <random>

#include "core/parallel.h"
#include "methods/perturbation/batch.h"
#include "methods/perturbation/path.h"
#include "methods/perturbation/ray_octree.h"
#include "methods/perturbation/test_ball.h"
#include "methods/perturbation/virtual_objects.h"
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
  std::vector<BounceRecord> records;
  std::vector<VertexMove> vertices;
  std::vector<glm::dvec3> points;

  Setup() {
    constexpr int kWidth = 80;
    constexpr int kHeight = 60;
    const Vector<double> q{{eye.x, eye.y, eye.z}};
    std::vector<std::uint32_t> rayAt(std::size_t{kWidth * kHeight}, kNoRay);
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const glm::dvec3 target(2.4 * (i % kWidth + 0.5) / kWidth - 1.2,
                              2.2 * (0.5 + i / kWidth) / kHeight - 0.1, 0.0);
      const glm::dvec3 d = glm::normalize(target - eye);
      const auto hit = implicit::firstHit(vase, {eye, d});
      if (hit.status != implicit::HitStatus::Hit) continue;
      const glm::dvec3 x = eye + hit.t * d;
      PathVertex<double> vertex{{{x.x, x.y, x.z}}, {}, 1.0};
      if (implicit::derivativesAt(vase, x, vertex.g) != implicit::PointStatus::Smooth) continue;
      const glm::dvec3 n(vertex.g.c[1], vertex.g.c[2], vertex.g.c[3]);
      const glm::dvec3 out = glm::reflect(d, glm::normalize(n));
      const glm::dvec3 p = x + out;
      const auto e = expandPath<double>({{p.x, p.y, p.z}}, {vertex}, q);
      if (e.status != PathStatus::Regular) continue;
      rayAt[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(rays.size());
      rays.push_back({x, out});
      records.push_back(recordOf(e.bounces[0]));
    }
    neighbours = gridNeighbours(kWidth, kHeight, rayAt);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    constexpr std::uint32_t kVertices = 100'000;
    const auto count = static_cast<std::uint32_t>(records.size());
    for (std::uint32_t i = 0; i < kVertices; ++i) {
      // Neighbours share a nearest ray, as an object's vertices do.
      vertices.push_back(
          {i / 16 % count, 1.5f + unit(random), {0.05f * unit(random), 0.05f, 0.02f}});
      const double t = 6.28 * i / kVertices;
      points.emplace_back(1.5 * std::cos(t), 1.0 + 0.5 * std::sin(40 * t), 2.0 + std::sin(t));
    }
  }
};
const Setup& setup() {
  static const Setup made;
  return made;
}

constexpr std::size_t kGrain = 8192;

void jacobiansAndHessians(benchmark::State& state) {
  const Setup& s = setup();
  setThreadCount(static_cast<int>(state.range(0)));
  std::vector<DerivativeBlock> blocks((s.vertices.size() + 3) / 4);
  for (auto _ : state) {
    parallelFor(blocks.size(), kGrain / 4, [&](std::size_t begin, std::size_t end) {
      const std::size_t last = std::min(4 * end, s.vertices.size());
      vertexDerivatives(s.records, std::span(s.vertices).subspan(4 * begin, last - 4 * begin),
                        std::span(blocks).subspan(begin, end - begin));
    });
    benchmark::DoNotOptimize(blocks.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.vertices.size()));
}
BENCHMARK(jacobiansAndHessians)->Arg(1)->Arg(2)->MeasureProcessCPUTime();

void moves(benchmark::State& state) {
  const Setup& s = setup();
  setThreadCount(static_cast<int>(state.range(1)));
  std::vector<MovedVertex> moved(s.vertices.size());
  for (auto _ : state) {
    parallelFor(s.vertices.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      moveVertices(s.records, std::span(s.vertices).subspan(begin, end - begin),
                   static_cast<int>(state.range(0)), std::span(moved).subspan(begin, end - begin));
    });
    benchmark::DoNotOptimize(moved.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.vertices.size()));
}
BENCHMARK(moves)->Args({1, 1})->Args({2, 1})->Args({2, 2})->MeasureProcessCPUTime();

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
    benchmark::DoNotOptimize(tree.nodeCount());
  }
}
BENCHMARK(octree)->Unit(benchmark::kMillisecond);

void expansions(benchmark::State& state) {
  const Setup& s = setup();
  const Vector<double> q{{s.eye.x, s.eye.y, s.eye.z}};
  for (auto _ : state) {
    for (const SampleRay& ray : s.rays) {
      PathVertex<double> vertex{{{ray.origin.x, ray.origin.y, ray.origin.z}}, {}, 1.0};
      implicit::derivativesAt(s.vase, ray.origin, vertex.g);
      const glm::dvec3 p = ray.origin + ray.direction;
      benchmark::DoNotOptimize(expandPath<double>({{p.x, p.y, p.z}}, {vertex}, q));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.rays.size()));
}
BENCHMARK(expansions);

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
