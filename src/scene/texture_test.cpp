#include "scene/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace catoptric::scene {
namespace {

double decode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}
double encode(double linear) {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

std::vector<std::uint8_t> noise(int width, int height) {
  std::mt19937 random(7);
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width * height * 4));
  for (std::uint8_t& v : rgba) v = static_cast<std::uint8_t>(random() & 255);
  return rgba;
}

TEST(Texture, MeansOfTwoValuesAreRoundedToNearest) {
  std::vector<std::uint8_t> pairs;
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      for (const int k : {a, b}) pairs.insert(pairs.end(), 4, static_cast<std::uint8_t>(k));
    }
  }
  const std::vector<MipLevel> levels = makeMipChain(2 * 65536, 1, pairs, true);
  for (std::size_t i = 0; i < 65536; ++i) {
    const auto a = static_cast<double>(i / 256);
    const auto b = static_cast<double>(i % 256);
    const double mean = encode(0.5 * (decode(a / 255.0) + decode(b / 255.0))) * 255.0;
    const std::uint8_t made = levels[1].rgba[4 * i];
    EXPECT_LE(std::abs(made - mean), 0.5 + 1e-3) << a << " and " << b;
    if (a == b) {
      EXPECT_EQ(made, a);
    }
  }
}

TEST(Texture, SizesOfTheChain) {
  const std::vector<MipLevel> levels = makeMipChain(7, 3, noise(7, 3), true);
  ASSERT_EQ(levels.size(), 3u);
  EXPECT_EQ(mipLevelCount(7, 3), 3);
  EXPECT_EQ(levels[1].width, 3);
  EXPECT_EQ(levels[1].height, 1);
  EXPECT_EQ(levels[2].width, 1);
  EXPECT_EQ(levels[2].height, 1);
  EXPECT_EQ(mipChainBytes(7, 3), 4u * (21 + 3 + 1));
  EXPECT_EQ(mipLevelCount(1024, 1024), 11);
  EXPECT_EQ(makeMipChain(1, 1, {1, 2, 3, 4}, true).size(), 1u);
}

TEST(Texture, BlackAndWhiteMeetInLinearLight) {
  const std::vector<std::uint8_t> rgba = {0, 0, 0, 0, 255, 255, 255, 255};
  // Half the light is 188 in sRGB; data and alpha average as numbers.
  EXPECT_EQ(makeMipChain(2, 1, rgba, true)[1].rgba,
            (std::vector<std::uint8_t>{188, 188, 188, 128}));
  EXPECT_EQ(makeMipChain(2, 1, rgba, false)[1].rgba,
            (std::vector<std::uint8_t>{128, 128, 128, 128}));
}

TEST(Texture, OddSizesAreAreaMeans) {
  // 3 texels become 1: the plain mean. 5 become 2: weights 2/5, 2/5, 1/5 and 1/5, 2/5, 2/5.
  const auto gray = [](std::initializer_list<int> values) {
    std::vector<std::uint8_t> rgba;
    for (const int v : values) {
      rgba.insert(rgba.end(), 4, static_cast<std::uint8_t>(v));
    }
    return rgba;
  };
  EXPECT_EQ(makeMipChain(3, 1, gray({30, 60, 90}), false)[1].rgba, gray({60}));
  EXPECT_EQ(makeMipChain(1, 3, gray({30, 60, 90}), false)[1].rgba, gray({60}));
  EXPECT_EQ(makeMipChain(5, 1, gray({100, 50, 200, 0, 10}), false)[1].rgba, gray({100, 44}));
}

TEST(Texture, LastLevelIsTheMeanOfTheImage) {
  for (const auto& [width, height] : {std::pair(64, 64), std::pair(37, 23), std::pair(5, 100)}) {
    const std::vector<std::uint8_t> rgba = noise(width, height);
    for (const bool srgb : {true, false}) {
      const std::vector<MipLevel> levels = makeMipChain(width, height, rgba, srgb);
      for (std::size_t c = 0; c < 4; ++c) {
        double mean = 0.0;
        for (std::size_t i = c; i < rgba.size(); i += 4) {
          mean += srgb && c < 3 ? decode(rgba[i] / 255.0) : rgba[i] / 255.0;
        }
        mean /= width * height;
        const double expected = 255.0 * (srgb && c < 3 ? encode(mean) : mean);
        EXPECT_NEAR(levels.back().rgba[c], expected, 0.51) << width << 'x' << height;
      }
    }
  }
}

TEST(Texture, ConstantStaysConstant) {
  for (int v = 0; v < 256; v += 5) {
    const std::vector<std::uint8_t> rgba(13 * 6 * 4, static_cast<std::uint8_t>(v));
    for (const MipLevel& level : makeMipChain(13, 6, rgba, true)) {
      for (const std::uint8_t x : level.rgba) EXPECT_EQ(x, v);
    }
  }
}

}  // namespace
}  // namespace catoptric::scene
