// FLIP against values worked out by hand from the papers' formulas, against those of the authors'
// program, and its properties.
#include "measure/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace catoptric::measure {
namespace {

using image::Image;

Image flat(int width, int height, float r, float g, float b) {
  Image image{width, height, {"R", "G", "B"}, {}};
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    image.data.insert(image.data.end(), {r, g, b});
  return image;
}
Image noise(int width, int height, unsigned seed) {
  Image image{width, height, {"R", "G", "B"}, {}};
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image.pixelCount() * 3; ++i)
    image.data.push_back(static_cast<float>(random() % 1024) / 512.0f);
  return image;
}
ColourView view(const Image& image) {
  return {&image, {0, 1, 2}};
}

/// [Andersson2020] in double precision for one constant colour against another: no features, and
/// the filters change nothing.
double constantFlip(const double (&p)[3], const double (&q)[3]) {
  const auto lab = [](const double(&c)[3], double(&out)[3]) {
    // XYZ over that of white
    const double x = (10135552 * c[0] + 8788810 * c[1] + 4435075 * c[2]) / 23359437.0;
    const double y = (2613072 * c[0] + 8788810 * c[1] + 887015 * c[2]) / 12288897.0;
    const double z = (1425312 * c[0] + 8788810 * c[1] + 70074185 * c[2]) / 80288307.0;
    const auto f = [](double t) {
      return t > 216.0 / 24389.0 ? std::cbrt(t) : t * 841.0 / 108.0 + 4.0 / 29.0;
    };
    out[0] = 116 * f(y) - 16;
    out[1] = 5 * out[0] * (f(x) - f(y));
    out[2] = 2 * out[0] * (f(y) - f(z));
  };
  const auto hyab = [&](const double(&a)[3], const double(&b)[3]) {
    double la[3];
    double lb[3];
    lab(a, la);
    lab(b, lb);
    return std::fabs(la[0] - lb[0]) + std::hypot(la[1] - lb[1], la[2] - lb[2]);
  };
  const double largest = std::pow(hyab({0, 1, 0}, {0, 0, 1}), 0.7);
  const double error = std::pow(hyab(p, q), 0.7);
  return error < 0.4 * largest ? 0.95 * error / (0.4 * largest)
                               : 0.95 + 0.05 * (error - 0.4 * largest) / (0.6 * largest);
}

TEST(Flip, ConstantColoursByHand) {
  const double colours[][3] = {{0, 0, 0},       {1, 1, 1},          {0, 1, 0},      {0, 0, 1},
                               {0.5, 0.5, 0.5}, {0.501, 0.5, 0.49}, {0.2, 0.6, 0.1}};
  for (const auto& p : colours)
    for (const auto& q : colours) {
      const auto image = [](const double(&c)[3]) {
        return flat(33, 25, static_cast<float>(c[0]), static_cast<float>(c[1]),
                    static_cast<float>(c[2]));
      };
      const Image a = image(p);
      const Image b = image(q);
      const double expected = constantFlip(p, q);
      const std::vector<float> map = ldrFlip(view(a), view(b));
      for (const float e : map) ASSERT_NEAR(e, expected, 2e-4) << p[0] << p[1] << " " << q[0];
    }
  // Green against blue is the largest difference that there is. Black against white: 100 apart in
  // L, 100^0.7 = 25.119 of the largest 41.276, so 0.95 + 0.05 (0.6086 - 0.4) / 0.6
  EXPECT_NEAR(constantFlip({0, 1, 0}, {0, 0, 1}), 1.0, 1e-12);
  EXPECT_NEAR(constantFlip({0, 0, 0}, {1, 1, 1}), 0.96738, 1e-5);
}

/// A board under a ramp, with a line and stripes of another brightness.
Image board(int width, int height, float k) {
  Image image{width, height, {"R", "G", "B"}, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float base = ((x / 8 + y / 8) % 2 == 0 ? 0.0f : 0.5f) + 0.01f * static_cast<float>(x);
      image.data.insert(image.data.end(), {base + (x == 20 ? k : 0.0f),
                                           base * 0.8f + ((y / 4) % 2 == 0 ? 0.0f : 0.1f * k),
                                           0.2f + 0.02f * static_cast<float>(y)});
    }
  }
  return image;
}

/// What the authors' program (NVlabs/flip, python/flip_api.py of 2021; in double precision, its
/// OpenCV filters by SciPy's) gives for two pairs of images.
struct Published {
  double mean, first, inside, other, largest;  // pixels (0, 0), (20, 11) and (30, 25)
};

void expectMap(const std::vector<float>& map, int width, const Published& expected) {
  double sum = 0.0;
  float largest = 0.0f;
  for (const float e : map) {
    sum += static_cast<double>(e);
    largest = std::max(largest, e);
  }
  EXPECT_NEAR(sum / static_cast<double>(map.size()), expected.mean, 1e-5);
  EXPECT_NEAR(map[0], expected.first, 1e-4);
  EXPECT_NEAR(map[static_cast<std::size_t>(11 * width + 20)], expected.inside, 1e-4);
  EXPECT_NEAR(map[static_cast<std::size_t>(25 * width + 30)], expected.other, 1e-4);
  EXPECT_NEAR(largest, expected.largest, 1e-4);
}

TEST(Flip, AgreesWithTheAuthorsProgram) {
  const Image a = noise(40, 31, 1);
  const Image b = noise(40, 31, 2);
  expectMap(ldrFlip(view(a), view(b)), 40, {0.393668, 0.697428, 0.296019, 0.265538, 0.855119});
  expectMap(hdrFlip(view(a), view(b)), 40, {0.365556, 0.629900, 0.283213, 0.185365, 0.808557});
  const Image c = board(64, 48, 0.0f);
  const Image d = board(64, 48, 0.5f);
  expectMap(ldrFlip(view(c), view(d)), 64, {0.159124, 0.016151, 0.227319, 0.084459, 0.427581});
  expectMap(hdrFlip(view(c), view(d)), 64, {0.173302, 0.076787, 0.202384, 0.073178, 0.969374});
}

TEST(Flip, EqualImagesHaveNoError) {
  const Image image = noise(40, 31, 7);
  for (const float e : ldrFlip(view(image), view(image))) ASSERT_EQ(e, 0.0f);
  for (const float e : hdrFlip(view(image), view(image))) ASSERT_EQ(e, 0.0f);
}

TEST(Flip, IsSymmetricAndWithinItsRange) {
  const Image a = noise(40, 31, 1);
  const Image b = noise(40, 31, 2);
  const std::vector<float> ab = ldrFlip(view(a), view(b));
  const std::vector<float> ba = ldrFlip(view(b), view(a));
  const std::vector<float> hdr = hdrFlip(view(a), view(b));
  for (std::size_t i = 0; i < ab.size(); ++i) {
    ASSERT_EQ(ab[i], ba[i]);
    ASSERT_GE(ab[i], 0.0f);
    ASSERT_LE(ab[i], 1.0f);
    ASSERT_GE(hdr[i], 0.0f);
    ASSERT_LE(hdr[i], 1.0f);
  }
}

/// The 2D filters as the paper writes them, without separation, in double precision.
TEST(Flip, FeaturesOfAStepByHand) {
  // A grey step of 0.3 between equal halves against a flat image: only luminance differs, and one
  // pixel's error is worked out with the full 2D sums
  const int width = 48;
  const int height = 41;
  Image a = flat(width, height, 0.2f, 0.2f, 0.2f);
  const Image b = flat(width, height, 0.35f, 0.35f, 0.35f);
  for (int y = 0; y < height; ++y)
    for (int x = width / 2; x < width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        a.data[(static_cast<std::size_t>(y) * width + x) * 3 + c] = 0.5f;
  const double ppd = 67.0206433;
  const auto luminance = [&](int x) { return x >= width / 2 ? 0.5 : 0.2; };
  const int at = width / 2 + 1;
  const double sigma = 0.5 * 0.082 * ppd;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  double sum[2][2] = {};  // edge, point: positive, negative weights
  double result[2] = {};  // positive part, then both
  double edge[2] = {};
  double point[2] = {};
  for (int pass = 0; pass < 2; ++pass)
    for (int j = -radius; j <= radius; ++j)
      for (int i = -radius; i <= radius; ++i) {
        const double g = std::exp(-(i * i + j * j) / (2 * sigma * sigma));
        const double w[2] = {-i * g, (i * i / (sigma * sigma) - 1) * g};
        const double wy = (j * j / (sigma * sigma) - 1) * g;
        if (pass == 0) {
          for (int k = 0; k < 2; ++k) sum[k][w[k] < 0] += std::fabs(w[k]);
          continue;
        }
        edge[0] += w[0] / sum[0][w[0] < 0] * luminance(at + i);
        point[0] += w[1] / sum[1][w[1] < 0] * luminance(at + i);
        point[1] += wy / sum[1][wy < 0] * luminance(at + i);
      }
  result[0] = std::fabs(edge[0]);
  result[1] = std::hypot(point[0], point[1]);
  const double feature = std::sqrt(std::max(result[0], result[1]) / std::sqrt(2.0));
  // Filtered luminance for the colour part
  double weights = 0.0;
  double filtered = 0.0;
  for (int j = -10; j <= 10; ++j)
    for (int i = -10; i <= 10; ++i) {
      const double z = (i * i + j * j) / (ppd * ppd);
      const double w = std::exp(-M_PI * M_PI * z / 0.0047);
      weights += w;
      filtered += w * luminance(at + i);
    }
  const double v = filtered / weights;
  const double colour = constantFlip({v, v, v}, {0.35, 0.35, 0.35});
  const std::vector<float> map = ldrFlip(view(b), view(a));
  EXPECT_NEAR(map[static_cast<std::size_t>(height / 2) * width + at],
              std::pow(colour, 1.0 - feature), 5e-4);
}

TEST(Flip, HdrSeesWhatAScreenClips) {
  // 4 and 8 are both white on a screen; at -3 stops they are 0.5 and 1
  const Image a = flat(24, 20, 4, 4, 4);
  const Image b = flat(24, 20, 8, 8, 8);
  for (const float e : ldrFlip(view(a), view(b))) ASSERT_EQ(e, 0.0f);
  const auto aces = [](double x) {
    return (0.9036 * x * x + 0.018 * x) / (0.8748 * x * x + 0.354 * x + 0.14);
  };
  double expected = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double factor = std::exp2(-3.0 + 6.0 * i / 5.0);
    const double p = std::min(1.0, aces(4 * factor));
    const double q = std::min(1.0, aces(8 * factor));
    expected = std::max(expected, constantFlip({p, p, p}, {q, q, q}));
  }
  for (const float e : hdrFlip(view(a), view(b))) ASSERT_NEAR(e, expected, 5e-4);
  EXPECT_GT(expected, 0.3);
}

TEST(Flip, NotFiniteIsAllWrongAndStaysLocal) {
  Image a = flat(40, 40, 0.5f, 0.5f, 0.5f);
  const Image b = a;
  a.data[(20 * 40 + 20) * 3 + 1] = NAN;
  for (const auto& map : {ldrFlip(view(b), view(a)), hdrFlip(view(a), view(b))}) {
    EXPECT_EQ(map[20 * 40 + 20], 1.0f);
    EXPECT_EQ(map[0], 0.0f);
    for (const float e : map) ASSERT_TRUE(std::isfinite(e));
  }
}

TEST(Magma, Anchors) {
  // Of matplotlib's table: first, middle, last
  const int anchors[][4] = {{0, 0, 0, 4}, {1, 183, 55, 121}, {2, 252, 253, 191}};
  for (const auto& anchor : anchors) {
    const auto c = magma(static_cast<float>(anchor[0]) / 2.0f);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(c[i], anchor[i + 1], 7);
  }
}

}  // namespace
}  // namespace catoptric::measure
