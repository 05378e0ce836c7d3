// Samples that are interpolated between searched ones, as a structure of arrays. correct() refines
// each one's key-frame position by one Newton step and reads the key frame there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "methods/reprojection/key_frame.h"

namespace catoptric::methods::reprojection {

struct CellLanes {
  static constexpr std::size_t kMost = 256;
  using Lane = std::array<float, kMost>;

  std::size_t count = 0;
  std::array<std::int32_t, kMost> sample{};  ///< index of the sample; not used here
  std::array<std::uint32_t, kMost> reflector{};
  Vec3Lanes<kMost> origin, direction;         ///< as in MirrorRay
  alignas(64) Lane attachedX{}, attachedY{};  ///< position of the sample's surface in the key frame
  alignas(64) Lane x{}, y{};                  ///< key-frame position: guess, then corrected

  /// Copies lane `from` to lane `to`, to compact the lanes that need another correct().
  void copy(std::size_t from, std::size_t to) {
    sample[to] = sample[from];
    reflector[to] = reflector[from];
    origin.set(to, origin.at(from));
    direction.set(to, direction.at(from));
    for (Lane* lane : {&attachedX, &attachedY, &x, &y}) (*lane)[to] = (*lane)[from];
  }

  // Results of correct()
  alignas(64) Lane miss{}, length{};  ///< as in Match
  Vec3Lanes<kMost> light;
  /// 1 if the four key-frame samples around the position show one continuous surface in the same
  /// reflector and the correction was at most `near`; otherwise the lane's results are invalid.
  std::array<std::int32_t, kMost> found{};
};

/// One Newton step per lane, which minimizes the angle between its ray and the bilinearly
/// interpolated reflected point. Then reads the radiance as lookUp() does. `near`: largest accepted
/// correction, in samples of the key frame.
void correct(const KeyFrame& key, float near, CellLanes& lanes);

}  // namespace catoptric::methods::reprojection
