// Which place of a key frame's reflection buffers shows what a sample reflects now.
//
// The paper goes forwards: for each sample s of the key frame it looks for the sample s* whose
// surface would now reflect R, shifts and warps the picture [Xie2017] Sec. 3.2. This goes
// backwards, a gather: for each sample of the current frame, with its surface W and its mirrored
// ray d, it looks for the place k of the key frame whose R(k) lies on that ray. The distance that
// is made small is the angle between d and R(k) - W, which is also the test of the result
// (`fidelity`); it needs no silhouettes and no second image, and follows moving reflectors and
// reflected objects alike.
#pragma once

#include <cstdint>
#include <limits>

#include "core/math.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/options.h"

namespace catoptric::methods::reprojection {

/// Places as near to a sample as that are taken to be on it, and offsets as small as that to be 0,
/// so that what stands still keeps its very bits. In samples; ours: over an edge that is 5 samples
/// wide and of contrast 1 it is 1/255.
inline constexpr float kSnap = 0.02f;

/// Steps of the search, from each start; ours: the median of the rooms' samples needs 2, and 4
/// would do, but for mapping: grid.
inline constexpr int kMostSearchSteps = 16;

/// Why a sample's reflection is not taken from the key frame; Found: it is.
enum class Outcome : std::uint8_t {
  NotAsked,  ///< the sample does not reflect
  Found,
  NotSearched,    ///< a lobe, a body that refracts, a key frame
  NotFound,       ///< the search left the reflector, the buffers, or came to a stand
  Hidden,         ///< a nearer surface beside it may go on where the key frame saw no reflection
  Discontinuity,  ///< at an edge of what is reflected, or of the reflector
  Magnified,      ///< one sample would be stretched over too many
  Crossed,        ///< an object that moves may be in front of it now
  Unfaithful,     ///< what is kept there does not lie on the mirrored ray
  SecondBounce,  ///< what a mirror in the mirror shows was not found, or not where it sends the ray
};

/// A place in the key frame, in samples with centres at whole numbers.
struct Match {
  Vec2 place{0.0f};
  Outcome outcome = Outcome::NotAsked;
  /// Where Found: KeyFrame::length() there, infinite of the sky.
  float length = 0.0f;
  /// How far it was from the ray before the last correction, in samples; infinite: not measured.
  float miss = std::numeric_limits<float>::infinity();
};

/// The mirrored ray of a sample.
struct MirrorRay {
  Vec3 origin{0.0f};
  Vec3 direction{0.0f};         ///< unit length
  std::uint32_t reflector = 0;  ///< id
};

/// Descends from `start`. `match.place` is good to a hundredth of a sample where the outcome is
/// Found.
Match search(const KeyFrame& key, const MirrorRay& ray, const Vec2& start, const Options& options);

/// What the key frame shows at a place between samples.
struct Lookup {
  Vec3 radiance{0.0f};
  Vec4 place{0.0f};  ///< as KeyFrame::place()
  Outcome outcome = Outcome::Discontinuity;
};
/// Bilinear among the four samples about it, where they show one continuous surface in one
/// reflector; on a sample that sample alone; off a rim, by less than half a sample, those at it.
Lookup lookUp(const KeyFrame& key, std::uint32_t reflector, const Vec2& place,
              const Options& options);

/// How far `place` (as KeyFrame::place()) is from the mirrored ray, in samples of the key frame
/// about `at`; infinite where that cannot be said.
float missBy(const KeyFrame& key, const MirrorRay& ray, const Vec2& at, const Vec4& place,
             const Options& options);

}  // namespace catoptric::methods::reprojection
