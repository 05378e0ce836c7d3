// How long all measures of a frame take.
#include <benchmark/benchmark.h>

#include <random>

#include "measure/errors.h"

namespace catoptric::measure {
namespace {

image::Image noise(int size, unsigned seed) {
  image::Image image{size, size, {"R", "G", "B"}, {}};
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image.pixelCount() * 3; ++i)
    image.data.push_back(static_cast<float>(random() % 4096) / 2048.0f);
  return image;
}

void compareFrame(benchmark::State& state) {
  const image::Image a = noise(static_cast<int>(state.range(0)), 1);
  const image::Image b = noise(static_cast<int>(state.range(0)), 2);
  for (auto _ : state) benchmark::DoNotOptimize(compareImages(a, b).flip());
}
BENCHMARK(compareFrame)
    ->Arg(512)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace catoptric::measure

BENCHMARK_MAIN();
