#include "measure/display_steps.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "image/image.h"

namespace catoptric::measure {
namespace {

/// round(display8(value)) by a table: the smallest value of each step, found by bisection, and a
/// first guess from the leading bits of the value.
class Steps8 {
 public:
  Steps8() {
    for (int step = 1; step < 256; ++step) {
      std::uint32_t low = 0;  // shows less than `step`
      std::uint32_t high = std::bit_cast<std::uint32_t>(1.0f);
      while (high - low > 1) {
        const std::uint32_t middle = low + (high - low) / 2;
        const float shown = image::display8(std::bit_cast<float>(middle));
        (std::lround(shown) >= step ? high : low) = middle;
      }
      first_[static_cast<std::size_t>(step)] = std::bit_cast<float>(high);
    }
    for (std::size_t i = 0; i < guess_.size(); ++i) {
      const float least = std::bit_cast<float>(static_cast<std::uint32_t>(i) << kShift);
      int step = 0;
      while (step < 255 && first_[static_cast<std::size_t>(step + 1)] <= least) ++step;
      guess_[i] = static_cast<std::uint8_t>(step);
    }
  }
  int operator()(float value) const {
    if (!(value > 0.0f)) return 0;
    if (value >= 1.0f) return 255;
    int step = guess_[std::bit_cast<std::uint32_t>(value) >> kShift];
    while (step < 255 && value >= first_[static_cast<std::size_t>(step + 1)]) ++step;
    return step;
  }

 private:
  static constexpr int kShift = 17;
  std::array<float, 256> first_{};
  std::array<std::uint8_t, (0x3f800000u >> kShift) + 1> guess_{};
};

}  // namespace

int step8(float value) {
  static const Steps8 steps;
  return steps(value);
}

}  // namespace catoptric::measure
