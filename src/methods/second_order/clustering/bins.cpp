#include "methods/second_order/clustering/bins.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods::second_order {
namespace {

constexpr float kPoleSine = 1.75e-3f;  ///< sine of 0.1 degrees; ours
/// Objects of at least this share of the frame have this share of the bins at a density of 1,
/// however many objects there are: the rays of half a sphere do not fit one camera. Ours.
constexpr float kLeastArea = 1e-3f;
constexpr float kLeastBins = 0.04f;

/// Angle of (x, y) from +x in turns, 0..1; without branches, so that loops become vector
/// instructions. [Abramowitz1964] 4.4.49.
inline float turnOf(float x, float y) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float t = std::min(ax, ay) / std::max(std::max(ax, ay), 1e-30f);
  const float s = t * t;
  const float angle =
      t * (0.9998660f + s * (-0.3302995f + s * (0.1801410f + s * (-0.0851330f + s * 0.0208351f))));
  float turn = angle * (0.5f / kPi);
  turn = ay > ax ? 0.25f - turn : turn;
  turn = x < 0.0f ? 0.5f - turn : turn;
  return y < 0.0f ? 1.0f - turn : turn;
}

inline int binOfNormal(float x, float y, float z, const BinScale& scale) {
  const float across = x * x + z * z;
  float turn = across > kPoleSine * kPoleSine ? turnOf(x, z) + kBinOffset : 0.0f;
  turn = turn < 1.0f ? turn : turn - 1.0f;
  const float fall = 2.0f * turnOf(y, std::sqrt(across)) + kBinOffset;
  const auto last = [](int bins) { return static_cast<float>(bins) - 0.5f; };
  const float theta = std::min(turn * scale.theta, last(scale.thetaBins));
  const float phi = std::min(fall * scale.phi, last(scale.phiBins));
  return static_cast<int>(phi) * scale.thetaBins + static_cast<int>(theta);
}

}  // namespace

BinScale binScale(float areaFraction, int visibleObjects, const ClusterOptions& options) {
  float scale =
      options.binDensity * 100.0f * areaFraction / static_cast<float>(std::max(1, visibleObjects));
  if (areaFraction >= kLeastArea) scale = std::max(scale, kLeastBins * options.binDensity);
  scale = std::min(1.0f, scale);
  BinScale bins;
  bins.theta = std::max(1.0f, scale * static_cast<float>(options.maxThetaBins));
  bins.phi = std::max(1.0f, scale * static_cast<float>(options.maxPhiBins));
  bins.thetaBins = static_cast<int>(std::ceil(bins.theta));
  bins.phiBins = static_cast<int>(std::ceil(bins.phi));
  return bins;
}

void binsOf(const float* x, const float* y, const float* z, std::size_t count,
            const BinScale& scale, std::int32_t* bins) {
  const BinScale own = scale;  // which no write to `bins` changes
  for (std::size_t k = 0; k < count; ++k) bins[k] = binOfNormal(x[k], y[k], z[k], own);
}

}  // namespace catoptric::methods::second_order
