#include "methods/shared/band_steps.h"

#include <algorithm>

#include "core/clock.h"
#include "core/parallel.h"
#include "methods/shared/sample_tiles.h"

namespace catoptric::methods {
namespace {

/// Samples of a band: what fits a core's second cache, and keeps 16 threads busy. Ours.
constexpr int kBandSamples = 1 << 16;

}  // namespace

int rowsOfBand(int width) {
  return std::max(1, kBandSamples / (width * SampleTiles::kSize)) * SampleTiles::kSize;
}

BandSeconds runBands(std::size_t count, const BandSteps& steps, frame::StepTimer& timer) {
  BandSeconds seconds;
  if (count == 0) return seconds;
  const std::int64_t start = nowNs();
  const auto timed = [](double& sum, auto&& body) {
    const std::int64_t begin = nowNs();
    body();
    sum += secondsSince(begin);
  };
  const auto read = [&](std::size_t b) { timed(seconds.read, [&] { steps.read(b); }); };
  const auto upload = [&](std::size_t b) { timed(seconds.upload, [&] { steps.upload(b); }); };
  Background background;
  read(0);
  for (std::size_t b = 0; b < count; ++b) {
    background.start([&, b] { steps.work(b); });
    if (b > 0) upload(b - 1);
    if (b + 1 < count) read(b + 1);
    background.wait();
  }
  upload(count - 1);
  timed(seconds.upload, [&] { timer.finish(); });
  seconds.work = secondsSince(start) - seconds.read - seconds.upload;
  return seconds;
}

}  // namespace catoptric::methods
