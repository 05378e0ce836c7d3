#include "scene/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/srgb.h"

namespace catoptric::scene {
namespace {

struct SrgbTables {
  std::array<float, 256> linear{};
  /// threshold[k]: smallest linear value that rounds to k (0 for k = 0); one more at the end.
  std::array<float, 257> threshold{};
  static constexpr int kGuesses = 4096;
  /// guess[i]: the code of linear value i / kGuesses; never above the code of what follows.
  std::array<std::uint8_t, kGuesses + 1> guess{};
  std::array<float, 256> unorm{};

  SrgbTables() {
    for (int k = 0; k < 256; ++k) {
      linear[static_cast<std::size_t>(k)] = static_cast<float>(linearFromSrgb(k / 255.0));
      unorm[static_cast<std::size_t>(k)] = static_cast<float>(k / 255.0);
      threshold[static_cast<std::size_t>(k)] =
          k == 0 ? -1.0f : static_cast<float>(linearFromSrgb((k - 0.5) / 255.0));
    }
    threshold[256] = 2.0f;
    int code = 0;
    for (int i = 0; i <= kGuesses; ++i) {
      const float x = static_cast<float>(i) / kGuesses;
      while (x >= threshold[static_cast<std::size_t>(code) + 1]) ++code;
      guess[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(code);
    }
  }
};

const SrgbTables& tables() {
  static const SrgbTables instance;
  return instance;
}

std::uint8_t encodeSrgb(const SrgbTables& t, float x) {
  x = std::clamp(x, 0.0f, 1.0f);
  std::size_t code = t.guess[static_cast<std::size_t>(x * SrgbTables::kGuesses)];
  while (x >= t.threshold[code + 1]) ++code;
  return static_cast<std::uint8_t>(code);
}

std::uint8_t encodeUnorm(float x) {
  return static_cast<std::uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// The source texels that one texel of the next level covers along one axis, with their shares.
struct Taps {
  int first = 0;
  int count = 0;
  std::array<float, 3> weight{};
};

std::vector<Taps> tapsOf(int from, int to) {
  std::vector<Taps> taps(static_cast<std::size_t>(to));
  for (int i = 0; i < to; ++i) {
    Taps& t = taps[static_cast<std::size_t>(i)];
    if (from == to) {
      t = {i, 1, {1.0f, 0.0f, 0.0f}};
    } else if (from % 2 == 0) {
      t = {2 * i, 2, {0.5f, 0.5f, 0.0f}};
    } else {
      // from = 2 to + 1: texel i covers [i, i + 1] * from / to.
      const auto total = static_cast<float>(from);
      t = {2 * i,
           3,
           {static_cast<float>(to - i) / total, static_cast<float>(to) / total,
            static_cast<float>(i + 1) / total}};
    }
  }
  return taps;
}

/// Linear float RGBA of one level.
struct FloatLevel {
  int width = 0;
  int height = 0;
  std::vector<Vec4> texels;
};

/// `row(y)` gives the linear texels of a row of the finer level.
template <class Row>
FloatLevel halve(int width, int height, Row&& row) {
  FloatLevel next;
  next.width = std::max(1, width / 2);
  next.height = std::max(1, height / 2);
  next.texels.assign(static_cast<std::size_t>(next.width) * static_cast<std::size_t>(next.height),
                     Vec4(0.0f));
  const std::vector<Taps> across = tapsOf(width, next.width);
  const std::vector<Taps> down = tapsOf(height, next.height);
  for (int y = 0; y < next.height; ++y) {
    Vec4* out = next.texels.data() + static_cast<std::size_t>(y) * next.width;
    const Taps& rows = down[static_cast<std::size_t>(y)];
    for (int k = 0; k < rows.count; ++k) {
      const Vec4* in = row(rows.first + k);
      const float rowWeight = rows.weight[static_cast<std::size_t>(k)];
      for (int x = 0; x < next.width; ++x) {
        const Taps& t = across[static_cast<std::size_t>(x)];
        Vec4 sum = in[t.first] * t.weight[0];
        for (int j = 1; j < t.count; ++j) {
          sum += in[t.first + j] * t.weight[static_cast<std::size_t>(j)];
        }
        out[x] += sum * rowWeight;
      }
    }
  }
  return next;
}

MipLevel encoded(const FloatLevel& level, bool srgb) {
  const SrgbTables& t = tables();
  MipLevel result;
  result.width = level.width;
  result.height = level.height;
  result.rgba.resize(level.texels.size() * 4);
  std::uint8_t* out = result.rgba.data();
  for (const Vec4& texel : level.texels) {
    for (int c = 0; c < 3; ++c) {
      out[c] = srgb ? encodeSrgb(t, texel[c]) : encodeUnorm(texel[c]);
    }
    out[3] = encodeUnorm(texel.w);
    out += 4;
  }
  return result;
}

}  // namespace

int mipLevelCount(int width, int height) {
  int levels = 1;
  for (int size = std::max(width, height); size > 1; size /= 2) ++levels;
  return levels;
}

std::size_t mipChainBytes(int width, int height) {
  std::size_t bytes = 0;
  for (;;) {
    bytes += static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4;
    if (width == 1 && height == 1) return bytes;
    width = std::max(1, width / 2);
    height = std::max(1, height / 2);
  }
}

std::vector<MipLevel> makeMipChain(int width, int height, std::vector<std::uint8_t> rgba,
                                   bool srgb) {
  const SrgbTables& t = tables();
  std::vector<MipLevel> levels;
  levels.reserve(static_cast<std::size_t>(mipLevelCount(width, height)));
  levels.push_back({width, height, std::move(rgba)});
  if (width == 1 && height == 1) return levels;

  // The first step decodes the image row by row; the others go on from unrounded values.
  const std::array<float, 256>& decode = srgb ? t.linear : t.unorm;
  std::vector<Vec4> decodedRow(static_cast<std::size_t>(width));
  int decodedY = -1;
  const std::uint8_t* base = levels.front().rgba.data();
  FloatLevel level = halve(width, height, [&](int y) {
    if (y != decodedY) {
      const std::uint8_t* in =
          base + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) * 4;
      for (Vec4& texel : decodedRow) {
        texel = Vec4(decode[in[0]], decode[in[1]], decode[in[2]], t.unorm[in[3]]);
        in += 4;
      }
      decodedY = y;
    }
    return decodedRow.data();
  });
  levels.push_back(encoded(level, srgb));
  while (level.width > 1 || level.height > 1) {
    level = halve(level.width, level.height, [&](int y) {
      return level.texels.data() + static_cast<std::size_t>(y) * level.width;
    });
    levels.push_back(encoded(level, srgb));
  }
  return levels;
}

}  // namespace catoptric::scene
