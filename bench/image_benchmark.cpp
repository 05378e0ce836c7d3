// EXR and PNG encoding of a frame of 1024 x 1024, previews, and what loading the module costs.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "core/clock.h"
#include "core/parallel.h"
#include "image/image.h"

namespace catoptric::image {
namespace {

constexpr int kSize = 1024;

/// Smooth shading with a little noise, as rendered frames have it: neither flat nor random.
Image frame(const std::vector<std::string>& channels) {
  Image image{kSize, kSize, channels, {}};
  image.data.reserve(image.pixelCount() * channels.size());
  std::mt19937 random(1);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (std::size_t c = 0; c < channels.size(); ++c) {
        const float u = static_cast<float>(x) / kSize;
        const float v = static_cast<float>(y) / kSize;
        const bool tile = ((x / 64) + (y / 64)) % 2 == 0;
        const float shade = 0.3f + 0.2f * std::sin(7.0f * u + static_cast<float>(c)) * v;
        const float noise = static_cast<float>(random() % 1024) * 1e-5f;
        image.data.push_back(channels[c] == "A" ? 1.0f : (tile ? shade : 0.6f * shade) + noise);
      }
  return image;
}

/// Before all others: the time of the first call, module and codecs included.
double loadSeconds() {
  static const double seconds = [] {
    const std::int64_t start = nowNs();
    displayRgb8(Image{1, 1, {"R", "G", "B"}, {0, 0, 0}});
    return secondsSince(start);
  }();
  return seconds;
}

void loadModule(benchmark::State& state) {
  for (auto _ : state) state.SetIterationTime(loadSeconds());
}
BENCHMARK(loadModule)->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);

void writeExr(benchmark::State& state, std::vector<std::string> channels, Compression compression,
              bool half) {
  loadSeconds();
  const Image image = frame(channels);
  ExrOptions options;
  options.compression = compression;
  options.halfBeauty = half;
  std::size_t bytes = 0;
  for (auto _ : state) bytes = encodeExr(image, options).size();
  state.counters["MiB"] = static_cast<double>(bytes) / 1048576.0;
}
const std::vector<std::string> kRgb = {"R", "G", "B"};
const std::vector<std::string> kRgba = {"R", "G", "B", "A"};
#define CATOPTRIC_EXR(name, channels, compression, half)                      \
  BENCHMARK_CAPTURE(writeExr, name, channels, Compression::compression, half) \
      ->Unit(benchmark::kMillisecond)                                         \
      ->UseRealTime()
CATOPTRIC_EXR(half_rgb_none, kRgb, None, true);
CATOPTRIC_EXR(half_rgb_piz, kRgb, Piz, true);
CATOPTRIC_EXR(half_rgb_zip4, kRgb, Zip, true);
CATOPTRIC_EXR(half_rgba_none, kRgba, None, true);
CATOPTRIC_EXR(half_rgba_piz, kRgba, Piz, true);
CATOPTRIC_EXR(half_rgba_zip4, kRgba, Zip, true);
CATOPTRIC_EXR(float_rgba_zip4, kRgba, Zip, false);

void readExr(benchmark::State& state) {
  const auto bytes = encodeExr(frame(kRgba), {});
  const auto path = std::filesystem::temp_directory_path() / "catoptric_image_benchmark.exr";
  std::FILE* file = std::fopen(path.c_str(), "wb");
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  std::fclose(file);
  for (auto _ : state) benchmark::DoNotOptimize(readImage(path).data.data());
  std::filesystem::remove(path);
}
BENCHMARK(readExr)->Unit(benchmark::kMillisecond)->UseRealTime();

void preview(benchmark::State& state) {
  loadSeconds();
  const Image image = frame(kRgba);
  for (auto _ : state) benchmark::DoNotOptimize(displayRgb8(image).data());
}
BENCHMARK(preview)->Unit(benchmark::kMillisecond);

void writePng(benchmark::State& state) {
  const auto pixels = displayRgb8(frame(kRgba));
  std::size_t bytes = 0;
  for (auto _ : state) bytes = encodePng(kSize, kSize, 3, pixels).size();
  state.counters["MiB"] = static_cast<double>(bytes) / 1048576.0;
}
BENCHMARK(writePng)->Unit(benchmark::kMillisecond);

void encodeDisplay8(benchmark::State& state) {
  const Image image = frame(kRgb);
  for (auto _ : state) {
    float sum = 0.0f;
    for (const float value : image.data) sum += display8(value);
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(encodeDisplay8)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace catoptric::image

BENCHMARK_MAIN();
