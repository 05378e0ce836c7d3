#include "methods/reprojection/border.h"

#include <array>

namespace catoptric::methods::reprojection {

std::span<const Border::Member> Border::find(const MirrorSamples& samples, const Reuse& reuse,
                                             std::span<const std::uint32_t> missing, int width) {
  members_.clear();
  if (width == 0) return members_;
  ring_.clear();
  for (const std::uint32_t i : missing)
    if (reuse.outcome(i) != Outcome::Discontinuity && reuse.outcome(i) != Outcome::NotSearched)
      ring_.push_back(i);
  taken_.assign(samples.count(), 0);
  const int columns = samples.source().sampleWidth();
  const int rows = samples.source().sampleHeight();
  for (int distance = 1; distance <= width; ++distance) {
    next_.clear();
    const float traced = 1.0f - static_cast<float>(distance) / static_cast<float>(width + 1);
    for (const std::uint32_t from : ring_) {
      const auto place = static_cast<int>(samples.places()[from]);
      const int x = place % columns;
      const int y = place / columns;
      for (const auto& [nx, ny] :
           std::array<std::array<int, 2>, 4>{{{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}}) {
        if (nx < 0 || ny < 0 || nx >= columns || ny >= rows) continue;
        const std::int32_t n = reuse.sampleAt(nx, ny);
        if (n < 0 || taken_[n] != 0 || reuse.outcome(n) != Outcome::Found ||
            samples.rays()[n].reflector != samples.rays()[from].reflector)
          continue;
        taken_[n] = 1;
        next_.push_back(static_cast<std::uint32_t>(n));
        members_.push_back({static_cast<std::uint32_t>(n), traced});
      }
    }
    ring_.swap(next_);
  }
  return members_;
}

}  // namespace catoptric::methods::reprojection
