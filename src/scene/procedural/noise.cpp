#include "scene/procedural/noise.h"

namespace catoptric::scene::procedural {

Field fbm(int size, int periodX, int periodY, int octaves, std::uint32_t seed, float gain) {
  struct Octave {
    int px, py;
    float amplitude;
    std::vector<Vec2> gradients;
    std::vector<int> cell;      ///< of each column
    std::vector<float> offset;  ///< in its cell
    std::vector<float> fade;
  };
  std::vector<Octave> all;
  float amplitude = 1.0f;
  float sum = 0.0f;
  for (int o = 0; o < octaves; ++o) {
    const int px = std::max(1, periodX << o);
    const int py = std::max(1, periodY << o);
    // Finer than two texels a cell is aliasing, no detail.
    if (o > 0 && (px > size / 2 || py > size / 2)) break;
    Octave octave{px, py, amplitude, {}, {}, {}, {}};
    for (int y = 0; y < py; ++y) {
      for (int x = 0; x < px; ++x) {
        const float angle = 2.0f * kPi * hash01(x, y, seed + static_cast<std::uint32_t>(o) * 101u);
        octave.gradients.emplace_back(std::cos(angle), std::sin(angle));
      }
    }
    for (int x = 0; x < size; ++x) {
      const float at =
          (static_cast<float>(x) + 0.5f) * static_cast<float>(px) / static_cast<float>(size);
      const auto cell = static_cast<int>(at);
      const float t = at - static_cast<float>(cell);
      octave.cell.push_back(std::min(cell, px - 1));
      octave.offset.push_back(t);
      octave.fade.push_back(t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f));
    }
    sum += amplitude;
    amplitude *= gain;
    all.push_back(std::move(octave));
  }
  Field field(size);
  const float scale = 1.5f / sum;
  forRows(size, [&](int y) {
    float* row = field.row(y);
    std::vector<float> slope;
    std::vector<float> base;
    for (const Octave& octave : all) {
      const float at =
          (static_cast<float>(y) + 0.5f) * static_cast<float>(octave.py) / static_cast<float>(size);
      const auto cell = std::min(static_cast<int>(at), octave.py - 1);
      const float t = at - static_cast<float>(cell);
      const float fade = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
      const int next = (cell + 1) % octave.py;
      // Along a row the noise of each lattice column is linear: slope * dx + base.
      slope.resize(static_cast<std::size_t>(octave.px) + 1);
      base.resize(slope.size());
      for (int x = 0; x <= octave.px; ++x) {
        const int column = x % octave.px;
        const Vec2 g0 = octave.gradients[static_cast<std::size_t>(cell * octave.px + column)];
        const Vec2 g1 = octave.gradients[static_cast<std::size_t>(next * octave.px + column)];
        slope[static_cast<std::size_t>(x)] = mix(g0.x, g1.x, fade);
        base[static_cast<std::size_t>(x)] = mix(g0.y * t, g1.y * (t - 1.0f), fade);
      }
      for (int x = 0; x < size; ++x) {
        const auto column = static_cast<std::size_t>(x);
        const auto c = static_cast<std::size_t>(octave.cell[column]);
        const float dx = octave.offset[column];
        const float left = slope[c] * dx + base[c];
        const float right = slope[c + 1] * (dx - 1.0f) + base[c + 1];
        const float noise = left + (right - left) * octave.fade[column];
        row[x] += octave.amplitude * noise;
      }
    }
    for (int x = 0; x < size; ++x) row[x] *= scale;
  });
  return field;
}

Cells::Cells(int period, float jitter, std::uint32_t seed)
    : period_(std::max(period, 1)), seed_(seed) {
  for (int y = 0; y < period_; ++y) {
    for (int x = 0; x < period_; ++x) {
      points_.emplace_back(0.5f + jitter * (hash01(x, y, seed) - 0.5f),
                           0.5f + jitter * (hash01(x, y, seed + 7u) - 0.5f));
    }
  }
}

Cell Cells::at(float u, float v) const {
  const float x = fract(u) * static_cast<float>(period_);
  const float y = fract(v) * static_cast<float>(period_);
  const auto cx = static_cast<int>(x);
  const auto cy = static_cast<int>(y);
  float nearest = 1e9f;
  float second = 1e9f;
  Cell result;
  int bestX = 0;
  int bestY = 0;
  for (int j = -1; j <= 1; ++j) {
    const int py = wrapNear(cy + j, period_);
    for (int i = -1; i <= 1; ++i) {
      const int px = wrapNear(cx + i, period_);
      const Vec2& p = points_[static_cast<std::size_t>(py * period_ + px)];
      const float dx = x - (static_cast<float>(cx + i) + p.x);
      const float dy = y - (static_cast<float>(cy + j) + p.y);
      const float d = dx * dx + dy * dy;
      if (d < nearest) {
        second = nearest;
        nearest = d;
        result.dx = dx;
        result.dy = dy;
        bestX = px;
        bestY = py;
      } else if (d < second) {
        second = d;
      }
    }
  }
  result.nearest = std::sqrt(nearest);
  result.second = std::sqrt(second);
  result.id =
      hash(static_cast<std::uint32_t>(bestX), static_cast<std::uint32_t>(bestY), seed_ + 13u);
  return result;
}

}  // namespace catoptric::scene::procedural
