#include "measure/ssim.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "core/parallel.h"

namespace catoptric::measure {

std::vector<double> ssimMap(std::span<const float> a, std::span<const float> b, int width,
                            int height) {
  assert(a.size() == b.size() && a.size() == static_cast<std::size_t>(width) * height);
  constexpr int kRadius = 5;
  constexpr double kSigma = 1.5;
  constexpr double kC1 = 0.01 * 0.01;  // (K L)^2 with L = 1
  constexpr double kC2 = 0.03 * 0.03;
  std::array<double, 2 * kRadius + 1> kernel{};
  for (int i = -kRadius; i <= kRadius; ++i)
    kernel[static_cast<std::size_t>(i + kRadius)] = std::exp(-0.5 * i * i / (kSigma * kSigma));
  // Windows are cut at the borders: what is left of their weights
  const auto inverseWeights = [&](int size) {
    std::vector<double> inverse;
    for (int i = 0; i < size; ++i) {
      double sum = 0.0;
      for (int k = std::max(-kRadius, -i); k <= std::min(kRadius, size - 1 - i); ++k)
        sum += kernel[static_cast<std::size_t>(k + kRadius)];
      inverse.push_back(1.0 / sum);
    }
    return inverse;
  };
  const std::vector<double> perColumn = inverseWeights(width);
  const std::vector<double> perRow = inverseWeights(height);

  // Five weighted means: a, b, aa, bb, ab; rows first, then columns
  constexpr std::size_t kMeans = 5;
  const auto stride = static_cast<std::size_t>(width);
  std::array<std::vector<double>, kMeans> rows;
  for (auto& plane : rows) plane.resize(a.size());
  parallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    const std::size_t padded = stride + 2 * kRadius;
    std::vector<double> line(padded * kMeans, 0.0);
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < stride; ++x) {
        const double va = a[y * stride + x];
        const double vb = b[y * stride + x];
        const double values[kMeans] = {va, vb, va * va, vb * vb, va * vb};
        for (std::size_t m = 0; m < kMeans; ++m) line[m * padded + kRadius + x] = values[m];
      }
      for (std::size_t m = 0; m < kMeans; ++m) {
        double* __restrict out = rows[m].data() + y * stride;
        for (std::size_t k = 0; k < kernel.size(); ++k) {
          const double w = kernel[k];
          const double* in = line.data() + m * padded + k;
          for (std::size_t x = 0; x < stride; ++x) out[x] += w * in[x];
        }
        for (std::size_t x = 0; x < stride; ++x) out[x] *= perColumn[x];
      }
    }
  });
  std::vector<double> map(a.size());
  parallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    std::array<std::vector<double>, kMeans> mean;
    for (std::size_t y = begin; y < end; ++y) {
      const int row = static_cast<int>(y);
      for (std::size_t m = 0; m < kMeans; ++m) {
        mean[m].assign(stride, 0.0);
        double* __restrict out = mean[m].data();
        for (int k = std::max(-kRadius, -row); k <= std::min(kRadius, height - 1 - row); ++k) {
          const double w = kernel[static_cast<std::size_t>(k + kRadius)] * perRow[y];
          const double* in = rows[m].data() + static_cast<std::size_t>(row + k) * stride;
          for (std::size_t x = 0; x < stride; ++x) out[x] += w * in[x];
        }
      }
      for (std::size_t x = 0; x < stride; ++x) {
        const double ma = mean[0][x];
        const double mb = mean[1][x];
        const double varianceA = mean[2][x] - ma * ma;
        const double varianceB = mean[3][x] - mb * mb;
        const double covariance = mean[4][x] - ma * mb;
        map[y * stride + x] = (2.0 * ma * mb + kC1) * (2.0 * covariance + kC2) /
                              ((ma * ma + mb * mb + kC1) * (varianceA + varianceB + kC2));
      }
    }
  });
  return map;
}

double ssim(std::span<const float> a, std::span<const float> b, int width, int height) {
  double total = 0.0;
  for (const double v : ssimMap(a, b, width, height)) total += v;
  return total / static_cast<double>(a.size());
}

}  // namespace catoptric::measure
