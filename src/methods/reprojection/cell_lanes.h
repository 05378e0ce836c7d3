// Samples between searched ones, in arrays of one component each for vector code: their places in
// the key frame are corrected once, and what the key frame shows there is looked up.
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
  std::array<std::int32_t, kMost> sample{};  ///< for the caller
  std::array<std::uint32_t, kMost> reflector{};
  Vec3Lanes<kMost> origin, direction;         ///< as MirrorRay's
  alignas(64) Lane attachedX{}, attachedY{};  ///< where the key frame saw the sample's surface
  alignas(64) Lane x{}, y{};  ///< place in the key frame: as expected, then corrected

  /// Puts a lane in another one's place, so that it may be corrected once more.
  void copy(std::size_t from, std::size_t to) {
    sample[to] = sample[from];
    reflector[to] = reflector[from];
    origin.set(to, origin.at(from));
    direction.set(to, direction.at(from));
    for (Lane* lane : {&attachedX, &attachedY, &x, &y}) (*lane)[to] = (*lane)[from];
  }

  // What correct() makes of them
  alignas(64) Lane miss{}, length{};  ///< as Match's
  Vec3Lanes<kMost> light;
  /// 1 where four samples about the place show one continuous surface in the reflector, and it was
  /// no farther off than `near`; else nothing of the lane counts.
  std::array<std::int32_t, kMost> found{};
};

/// One step of Newton's method on the angle between each lane's ray and what the key frame shows
/// between four samples, and the light from there as of lookUp(). `near`: samples of the key frame.
void correct(const KeyFrame& key, float near, CellLanes& lanes);

}  // namespace catoptric::methods::reprojection
