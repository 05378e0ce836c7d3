#include "trace/lobes/environment_levels.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace catoptric::trace {
namespace {

/// Share of the sphere's height between two rows' borders, 0 on top, of `rows`: times 2 pi over the
/// columns a texel's solid angle.
double heightOf(double top, double bottom, double rows) {
  return std::cos(std::numbers::pi * top / rows) - std::cos(std::numbers::pi * bottom / rows);
}

}  // namespace

EnvironmentLevels::EnvironmentLevels(std::shared_ptr<const frame::EnvironmentLight> environment)
    : environment_(std::move(environment)) {
  if (environment_->pixels().empty()) return;
  levels_.push_back({environment_->width(), environment_->height(), environment_->pixels()});
  while (levels_.back().width > 1 || levels_.back().height > 1)
    levels_.push_back(halved(levels_.back()));
}

EnvironmentLevels::Level EnvironmentLevels::halved(const Level& from) {
  Level to{std::max(1, from.width / 2), std::max(1, from.height / 2), {}};
  to.texels.resize(static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height));
  // The part of each texel that lies under the larger one.
  const auto overlap = [](int i, double begin, double end) {
    return std::pair(std::max<double>(i, begin), std::min<double>(i + 1, end));
  };
  for (int y = 0; y < to.height; ++y) {
    const double top = static_cast<double>(y) * from.height / to.height;
    const double bottom = static_cast<double>(y + 1) * from.height / to.height;
    for (int x = 0; x < to.width; ++x) {
      const double left = static_cast<double>(x) * from.width / to.width;
      const double right = static_cast<double>(x + 1) * from.width / to.width;
      glm::dvec3 sum(0.0);
      double weights = 0.0;
      for (int row = static_cast<int>(top); row < std::min<double>(from.height, bottom); ++row) {
        const auto [rowTop, rowBottom] = overlap(row, top, bottom);
        const double height = heightOf(rowTop, rowBottom, from.height);
        for (int column = static_cast<int>(left); column < std::min<double>(from.width, right);
             ++column) {
          const auto [begin, end] = overlap(column, left, right);
          const double weight = height * (end - begin);
          sum += weight * glm::dvec3(from.texels[static_cast<std::size_t>(row) * from.width +
                                                 static_cast<std::size_t>(column)]);
          weights += weight;
        }
      }
      to.texels[static_cast<std::size_t>(y) * to.width + static_cast<std::size_t>(x)] =
          Vec3(sum / weights);
    }
  }
  return to;
}

Vec3 EnvironmentLevels::radiance(const Vec3& direction, float solidAngle) const {
  if (levels_.empty()) return environment_->radiance(direction);
  // Solid angle of a texel of level 0 there; at a pole that of its outermost row.
  const Level& finest = levels_.front();
  const float row = kPi / static_cast<float>(finest.height);
  const float sine =
      std::max(std::sqrt(std::max(0.0f, 1.0f - direction.y * direction.y)), std::sin(0.5f * row));
  const float texel = 2.0f * kPi / static_cast<float>(finest.width) * row * sine;
  const float last = static_cast<float>(levels_.size() - 1);
  const float level = std::min(0.5f * std::log2(std::max(solidAngle, 1e-20f) / texel), last);
  if (!(level > 0.0f)) return environment_->radiance(direction);

  const float scale = environment_->description().scale;
  const Vec2 uv = environment_->imageUv(direction);
  const auto below = static_cast<std::size_t>(level);
  const Vec3 fine = at(levels_[below], uv);
  const float fraction = level - static_cast<float>(below);
  if (!(fraction > 0.0f)) return scale * fine;
  return scale * glm::mix(fine, at(levels_[below + 1], uv), fraction);
}

Vec3 EnvironmentLevels::at(const Level& level, const Vec2& uv) const {
  const float px = uv.x * static_cast<float>(level.width) - 0.5f;
  const float py = uv.y * static_cast<float>(level.height) - 0.5f;
  const float fx = std::floor(px);
  const float fy = std::floor(py);
  const auto column = [&](int i) { return ((i % level.width) + level.width) % level.width; };
  const auto row = [&](int i) { return std::clamp(i, 0, level.height - 1); };
  const auto texel = [&](int i, int j) {
    return level.texels[static_cast<std::size_t>(row(j)) * level.width +
                        static_cast<std::size_t>(column(i))];
  };
  const int x = static_cast<int>(fx);
  const int y = static_cast<int>(fy);
  return glm::mix(glm::mix(texel(x, y), texel(x + 1, y), px - fx),
                  glm::mix(texel(x, y + 1), texel(x + 1, y + 1), px - fx), py - fy);
}

}  // namespace catoptric::trace
