#include "measure/flip.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>

#include "core/math.h"
#include "core/parallel.h"
#include "core/vector_versions.h"

// The innermost loops are plain ones for vector code (core/vector_versions.h).
namespace catoptric::measure {
namespace {

// ---- Functions that a compiler turns into vector instructions; errors below 1e-6 ----

/// log2 of a positive, normal number.
CATOPTRIC_INLINE float log2Fast(float x) {
  const std::int32_t bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;  // mantissa in sqrt(1/2) .. sqrt(2)
  const float m = std::bit_cast<float>(bits - exponent * (1 << 23));
  const float s = (m - 1.0f) / (m + 1.0f);
  const float q = s * s;
  const float series = 1.0f + q * (1.0f / 3.0f + q * (1.0f / 5.0f + q * (1.0f / 7.0f + q / 9.0f)));
  return static_cast<float>(exponent) + 2.88539008f * s * series;
}
/// 2^x for |x| < 126.
CATOPTRIC_INLINE float exp2Fast(float x) {
  // Rounds to whole numbers: GCC 12 vectorizes no (float)(int)x for AVX2
  constexpr float kRounding = 12582912.0f;  // 1.5 * 2^23
  const float rounded = (x + kRounding) - kRounding;
  const std::int32_t whole = static_cast<std::int32_t>(rounded);
  const float f = (x - rounded) * 0.693147181f;
  const float series =
      1.0f + f * (1.0f + f * (0.5f + f * (1.0f / 6 +
                                          f * (1.0f / 24 + f * (1.0f / 120 + f * (1.0f / 720))))));
  return series * std::bit_cast<float>((whole + 127) * (1 << 23));
}
/// x^y of x from 0 (which gives almost 0 for y > 0) and y in 0..1.
CATOPTRIC_INLINE float powFast(float x, float y) {
  return exp2Fast(y * log2Fast(std::max(x, 1e-30f)));
}

// ---- Colour spaces: linear Rec.709 -> XYZ over that of white ----

/// [Andersson2020] take these primaries' matrix as fractions; rows sum to the white point D65.
const glm::dmat3& relativeXyzFromRgb() {
  static const glm::dmat3 matrix = [] {
    const double rows[3][3] = {{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
                               {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
                               {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
    glm::dmat3 m(0.0);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) m[c][r] = rows[r][c] / (rows[r][0] + rows[r][1] + rows[r][2]);
    return m;
  }();
  return matrix;
}

/// Coefficients in registers.
struct Matrix {
  float m[3][3];
  explicit Matrix(const glm::dmat3& from) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) m[r][c] = static_cast<float>(from[c][r]);
  }
};

constexpr float kDelta = 6.0f / 29.0f;
CATOPTRIC_INLINE float labOf(float t) {
  const float root = powFast(t, 1.0f / 3.0f);
  const float line = t * (1.0f / (3.0f * kDelta * kDelta)) + 4.0f / 29.0f;
  return t > kDelta * kDelta * kDelta ? root : line;
}
struct Lab {
  float l, a, b;
};
/// L*a*b* of relative XYZ, chroma scaled with lightness. [Andersson2020] Sec. 4.1.2, Hunt effect
CATOPTRIC_INLINE Lab huntLab(float x, float y, float z) {
  const float fx = labOf(x);
  const float fy = labOf(y);
  const float fz = labOf(z);
  const float l = 116.0f * fy - 16.0f;
  return {l, 0.01f * l * 500.0f * (fx - fy), 0.01f * l * 200.0f * (fy - fz)};
}
CATOPTRIC_INLINE float hyab(const Lab& p, const Lab& q) {
  const float a = p.a - q.a;
  const float b = p.b - q.b;
  return std::fabs(p.l - q.l) + std::sqrt(a * a + b * b);
}

// ---- Filters ----

using Kernel = std::vector<float>;  ///< odd length, the middle is 0

/// exp(-i^2 / 2 sigma^2) for |i| <= radius, in pixels.
std::vector<double> gaussian(double sigma, int radius) {
  std::vector<double> g;
  for (int i = -radius; i <= radius; ++i) g.push_back(std::exp(-i * i / (2.0 * sigma * sigma)));
  return g;
}
Kernel scaled(const std::vector<double>& values, double factor) {
  Kernel kernel;
  for (const double v : values) kernel.push_back(static_cast<float>(v * factor));
  return kernel;
}
double sumOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum;
}

/// All filters for one viewing distance.
struct Filters {
  int radius = 0;                               ///< the widest
  Kernel achromatic, redGreen;                  ///< along rows and along columns
  Kernel blueYellow1, blueYellow2;              ///< two Gaussians: along rows ..
  Kernel blueYellow1Column, blueYellow2Column;  ///< .. and, weighted, along columns
  Kernel smooth, edge, point;                   ///< of the features

  explicit Filters(double pixelsPerDegree) {
    // Contrast sensitivity: sum of a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees.
    // [Andersson2020] Eq. (4), Table 1
    const auto sigmaOf = [&](double b) {
      return std::sqrt(b / (2.0 * std::numbers::pi * std::numbers::pi)) * pixelsPerDegree;
    };
    const int wide = static_cast<int>(std::ceil(3.0 * sigmaOf(0.04)));
    // What the narrow filters have beyond 6 sigma is below float's precision
    const auto normalised = [&](double b) {
      const double sigma = sigmaOf(b);
      const auto g = gaussian(sigma, std::min(wide, static_cast<int>(std::ceil(6.0 * sigma))));
      return scaled(g, 1.0 / sumOf(g));
    };
    achromatic = normalised(0.0047);
    redGreen = normalised(0.0053);
    const auto g1 = gaussian(sigmaOf(0.04), wide);
    const auto g2 = gaussian(sigmaOf(0.025), wide);
    const double w1 = 34.1 * std::sqrt(std::numbers::pi / 0.04);
    const double w2 = 13.5 * std::sqrt(std::numbers::pi / 0.025);
    const double total = w1 * sumOf(g1) * sumOf(g1) + w2 * sumOf(g2) * sumOf(g2);
    blueYellow1 = scaled(g1, 1.0);
    blueYellow2 = scaled(g2, 1.0);
    blueYellow1Column = scaled(g1, w1 / total);
    blueYellow2Column = scaled(g2, w2 / total);

    // Edges and points: first and second derivatives of a Gaussian whose peak-to-trough width is
    // 0.082 degrees; positive weights sum to 1, negative ones to -1. [Andersson2020] Sec. 4.2
    const double sigma = 0.5 * 0.082 * pixelsPerDegree;
    const int featureRadius = static_cast<int>(std::ceil(3.0 * sigma));
    const auto g = gaussian(sigma, featureRadius);
    smooth = scaled(g, 1.0 / sumOf(g));
    const auto balanced = [&](auto&& weight) {
      std::vector<double> values;
      double positive = 0.0;
      double negative = 0.0;
      for (int i = -featureRadius; i <= featureRadius; ++i) {
        values.push_back(weight(static_cast<double>(i)) *
                         g[static_cast<std::size_t>(i + featureRadius)]);
        (values.back() > 0.0 ? positive : negative) += values.back();
      }
      for (double& v : values)
        if (v != 0.0) v /= v > 0.0 ? positive : -negative;
      return scaled(values, 1.0);
    };
    edge = balanced([](double i) { return -i; });
    point = balanced([&](double i) { return i * i / (sigma * sigma) - 1.0; });
    radius = std::max(wide, featureRadius);
  }
};

/// out[x] = sum of kernel[k] * rows[k][x].
CATOPTRIC_INLINE void sumLoop(const Kernel& kernel, const float* const* rows, int width,
                              float* __restrict out) {
  std::fill_n(out, width, 0.0f);
  std::size_t k = 0;
  // Four taps at a time: fewer passes over `out`
  for (; k + 4 <= kernel.size(); k += 4) {
    const float w0 = kernel[k], w1 = kernel[k + 1], w2 = kernel[k + 2], w3 = kernel[k + 3];
    const float *a = rows[k], *b = rows[k + 1], *c = rows[k + 2], *d = rows[k + 3];
    for (int x = 0; x < width; ++x) out[x] += (w0 * a[x] + w1 * b[x]) + (w2 * c[x] + w3 * d[x]);
  }
  for (; k < kernel.size(); ++k) {
    const float w = kernel[k];
    const float* a = rows[k];
    for (int x = 0; x < width; ++x) out[x] += w * a[x];
  }
}

void weightedSum(const Kernel& kernel, const float* const* rows, int width, float* out) {
  atVectorLevel<sumLoop>(kernel, rows, width, out);
}

/// Planes of one image after the filters along its rows.
enum Plane { kA, kRg, kBy1, kBy2, kSmooth, kEdge, kPoint, kPlanes };
using Planes = std::array<std::vector<float>, kPlanes>;

/// The colour as a screen shows it, 0..1.
struct Exposure {
  bool toneMapped = false;
  float factor = 1.0f;
};
inline float shown(float v, const Exposure& exposure) {
  const float x = std::isfinite(v) ? std::max(v, 0.0f) * exposure.factor : 0.0f;
  if (!exposure.toneMapped) return std::min(x, 1.0f);
  // ACES curve by Narkowicz with its exposure of 0.6. [Andersson2021] Sec. 4
  const float u = std::min(x, 1e6f);
  const float y = (u * (0.9036f * u + 0.018f)) / (u * (0.8748f * u + 0.354f) + 0.14f);
  return std::min(y, 1.0f);
}

void filterRow(const ColourView& view, int y, const Exposure& exposure, const Filters& filters,
               Planes& planes) {
  static const Matrix toXyz(relativeXyzFromRgb());
  const int width = view.image->width;
  const int pad = filters.radius;
  const std::size_t stride = view.image->channels.size();
  const float* pixel = view.image->data.data() + static_cast<std::size_t>(y) * width * stride;
  const auto padded = static_cast<std::size_t>(width + 2 * pad);
  std::vector<float> buffer(3 * padded);
  float* luminance = buffer.data();
  float* redGreen = luminance + padded;
  float* blueYellow = redGreen + padded;
  for (int x = 0; x < width; ++x, pixel += stride) {
    float v[3];
    bool finite = true;
    for (std::size_t c = 0; c < 3; ++c) {
      v[c] = pixel[view.channels[c]];
      finite = finite && std::isfinite(v[c]);
    }
    for (float& c : v) c = finite ? shown(c, exposure) : 0.0f;
    const auto& m = toXyz.m;
    const float xr = m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2];
    const float yr = m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2];
    const float zr = m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2];
    // YCxCz without its factors and offset, which the filters keep
    luminance[pad + x] = yr;
    redGreen[pad + x] = xr - yr;
    blueYellow[pad + x] = yr - zr;
  }
  // Borders repeat
  for (float* row : {luminance, redGreen, blueYellow}) {
    std::fill_n(row, pad, row[pad]);
    std::fill_n(row + pad + width, pad, row[pad + width - 1]);
  }
  std::vector<const float*> taps;
  const auto filter = [&](const Kernel& kernel, const float* row, Plane plane) {
    const int first = pad - static_cast<int>(kernel.size() / 2);
    taps.clear();
    for (std::size_t k = 0; k < kernel.size(); ++k) taps.push_back(row + first + k);
    weightedSum(kernel, taps.data(), width,
                planes[plane].data() + static_cast<std::size_t>(y) * width);
  };
  filter(filters.achromatic, luminance, kA);
  filter(filters.redGreen, redGreen, kRg);
  filter(filters.blueYellow1, blueYellow, kBy1);
  filter(filters.blueYellow2, blueYellow, kBy2);
  filter(filters.smooth, luminance, kSmooth);
  filter(filters.edge, luminance, kEdge);
  filter(filters.point, luminance, kPoint);
}

/// A row of one image after the filters along columns.
struct Row {
  explicit Row(int width)
      : a(static_cast<std::size_t>(width)),
        rg(a),
        by(a),
        by2(a),
        edgeX(a),
        edgeY(a),
        pointX(a),
        pointY(a) {}
  std::vector<float> a, rg, by, by2, edgeX, edgeY, pointX, pointY;
  std::vector<const float*> taps;

  void filter(const Planes& planes, const Filters& filters, int y, int width, int height) {
    const auto column = [&](const Kernel& kernel, Plane plane, std::vector<float>& out) {
      const int size = static_cast<int>(kernel.size());
      taps.clear();
      for (int row = y - size / 2; row <= y + size / 2; ++row)
        taps.push_back(planes[plane].data() +
                       static_cast<std::size_t>(std::clamp(row, 0, height - 1)) * width);
      weightedSum(kernel, taps.data(), width, out.data());
    };
    column(filters.achromatic, kA, a);
    column(filters.redGreen, kRg, rg);
    column(filters.blueYellow1Column, kBy1, by);
    column(filters.blueYellow2Column, kBy2, by2);
    column(filters.smooth, kEdge, edgeX);
    column(filters.edge, kSmooth, edgeY);
    column(filters.smooth, kPoint, pointX);
    column(filters.point, kSmooth, pointY);
  }
};

/// Hunt-adjusted L*a*b* of filtered values, clamped to what a screen shows.
CATOPTRIC_INLINE Lab perceived(float y, float rg, float by, const Matrix& toXyz,
                               const Matrix& toRgb) {
  const float in[3] = {y + rg, y, y - by};
  float rgb[3];
  for (int r = 0; r < 3; ++r)
    rgb[r] = std::min(
        std::max(toRgb.m[r][0] * in[0] + toRgb.m[r][1] * in[1] + toRgb.m[r][2] * in[2], 0.0f),
        1.0f);
  float xyz[3];
  for (int r = 0; r < 3; ++r)
    xyz[r] = toXyz.m[r][0] * rgb[0] + toXyz.m[r][1] * rgb[1] + toXyz.m[r][2] * rgb[2];
  return huntLab(xyz[0], xyz[1], xyz[2]);
}

constexpr float kColourExponent = 0.7f;  // q_c
/// The largest colour difference: green against blue, to the power of q_c. [Andersson2020] 4.1.3
float largestColourError() {
  static const float value = [] {
    const auto lab = [](int c) {
      const glm::dvec3 xyz = relativeXyzFromRgb()[c];
      return huntLab(static_cast<float>(xyz.x), static_cast<float>(xyz.y),
                     static_cast<float>(xyz.z));
    };
    return powFast(hyab(lab(1), lab(2)), kColourExponent);
  }();
  return value;
}

CATOPTRIC_INLINE void errorLoop(const Row& p, const Row& q, int width, float* __restrict out) {
  static const Matrix toXyz(relativeXyzFromRgb());
  static const Matrix toRgb(glm::inverse(relativeXyzFromRgb()));
  // Errors up to 0.4 of the largest take 0.95 of the range. [Andersson2020] Sec. 4.1.3
  constexpr float kPc = 0.4f;
  constexpr float kPt = 0.95f;
  const float largest = largestColourError();
  const float knee = kPc * largest;
  const float below = kPt / knee;
  const float above = (1.0f - kPt) / (largest - knee);
  const Matrix xyz = toXyz;
  const Matrix rgb = toRgb;
  for (int i = 0; i < width; ++i) {
    const auto x = static_cast<std::size_t>(i);
    const Lab labP = perceived(p.a[x], p.rg[x], p.by[x] + p.by2[x], xyz, rgb);
    const Lab labQ = perceived(q.a[x], q.rg[x], q.by[x] + q.by2[x], xyz, rgb);
    const float power = powFast(hyab(labP, labQ), kColourExponent);
    const float colour = power < knee ? below * power : kPt + (power - knee) * above;

    const auto norm = [](float u, float v) { return std::sqrt(u * u + v * v); };
    const float edges = std::fabs(norm(p.edgeX[x], p.edgeY[x]) - norm(q.edgeX[x], q.edgeY[x]));
    const float points = std::fabs(norm(p.pointX[x], p.pointY[x]) - norm(q.pointX[x], q.pointY[x]));
    // q_f = 0.5; the factor brings the largest to 1. [Andersson2020] Eq. (13)
    const float feature = std::sqrt(0.707106781f * std::max(edges, points));
    // Equal colours: nothing of powFast's tiny numbers, unless a feature is all there is
    const float error = std::min(powFast(colour, std::max(1.0f - feature, 0.0f)), 1.0f);
    const float unlessEqual = power < 1e-12f ? 0.0f : error;
    out[x] = feature < 1.0f ? unlessEqual : error;
  }
}

void errorRow(const Row& p, const Row& q, int width, float* __restrict out) {
  atVectorLevel<errorLoop>(p, q, width, out);
}

/// One map for one exposure; `error` keeps the larger of what it had and this.
void flipMap(const ColourView& reference, const ColourView& test, const Exposure& exposure,
             const Filters& filters, std::array<Planes, 2>& planes, std::vector<float>& error) {
  const int width = reference.image->width;
  const int height = reference.image->height;
  const auto rows = static_cast<std::size_t>(height);
  parallelFor(rows, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      filterRow(reference, static_cast<int>(y), exposure, filters, planes[0]);
      filterRow(test, static_cast<int>(y), exposure, filters, planes[1]);
    }
  });
  parallelFor(rows, 16, [&](std::size_t begin, std::size_t end) {
    Row p(width);
    Row q(width);
    std::vector<float> row(static_cast<std::size_t>(width));
    for (std::size_t y = begin; y < end; ++y) {
      p.filter(planes[0], filters, static_cast<int>(y), width, height);
      q.filter(planes[1], filters, static_cast<int>(y), width, height);
      errorRow(p, q, width, row.data());
      float* out = error.data() + y * static_cast<std::size_t>(width);
      for (std::size_t x = 0; x < row.size(); ++x) out[x] = std::max(out[x], row[x]);
    }
  });
}

/// Pixels that are not finite are all wrong.
void markNotFinite(const ColourView& view, std::vector<float>& error) {
  const std::size_t stride = view.image->channels.size();
  for (std::size_t p = 0; p < error.size(); ++p)
    for (const int c : view.channels)
      if (!std::isfinite(view.image->data[p * stride + static_cast<std::size_t>(c)]))
        error[p] = 1.0f;
}

std::vector<float> largestOver(const ColourView& reference, const ColourView& test,
                               const FlipOptions& options, const std::vector<Exposure>& exposures) {
  assert(reference.image->pixelCount() == test.image->pixelCount() &&
         reference.image->pixelCount() > 0);
  const Filters filters(options.pixelsPerDegree);
  std::array<Planes, 2> planes;
  for (Planes& one : planes)
    for (auto& plane : one) plane.resize(reference.image->pixelCount());
  std::vector<float> error(reference.image->pixelCount(), 0.0f);
  for (const Exposure& exposure : exposures)
    flipMap(reference, test, exposure, filters, planes, error);
  markNotFinite(reference, error);
  markNotFinite(test, error);
  return error;
}

}  // namespace

std::vector<float> ldrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options) {
  return largestOver(reference, test, options, {Exposure{}});
}

std::vector<float> hdrFlip(const ColourView& reference, const ColourView& test,
                           const FlipOptions& options) {
  std::vector<Exposure> exposures;
  const int count = std::max(1, options.exposures);
  for (int i = 0; i < count; ++i) {
    const float share = count > 1 ? static_cast<float>(i) / static_cast<float>(count - 1) : 0.0f;
    exposures.push_back({true, std::exp2(options.startExposure +
                                         share * (options.stopExposure - options.startExposure))});
  }
  return largestOver(reference, test, options, exposures);
}

std::array<std::uint8_t, 3> magma(float error) {
  // Fit of degree 6 to matplotlib's table (both public domain), within a few steps of 255
  constexpr float kTerms[7][3] = {{-0.002136485f, -0.000749655f, -0.005386128f},
                                  {0.251660541f, 0.677523244f, 2.494026599f},
                                  {8.353717279f, -3.577719515f, 0.314467903f},
                                  {-27.668733086f, 14.264730781f, -13.649213188f},
                                  {52.176139812f, -27.943606072f, 12.944169442f},
                                  {-50.768525365f, 29.046582821f, 4.234152994f},
                                  {18.655705066f, -11.489773520f, -5.601961509f}};
  const float t = std::clamp(error, 0.0f, 1.0f);
  std::array<std::uint8_t, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    float value = 0.0f;
    for (int i = 6; i >= 0; --i) value = value * t + kTerms[i][c];
    colour[c] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  }
  return colour;
}

}  // namespace catoptric::measure
