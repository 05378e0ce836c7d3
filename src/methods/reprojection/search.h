// Searches a key frame's reflection buffers for the point that a sample reflects now.
//
// The paper maps forwards [Xie2017] Sec. 3.2. Let R be the point that sample s of the key frame
// reflects: the paper searches the sample s* whose surface would reflect R now, and shifts and
// warps the image. This code gathers instead: for each sample of the current frame, with surface
// point W and mirrored ray d, it searches the position k of the key frame whose R(k) lies on that
// ray. It minimizes the angle between d and R(k) - W, which also decides whether the result is
// accepted (`fidelity`). The gather needs no second image, and works for moving reflectors and
// reflected objects.
#pragma once

#include <cstdint>
#include <limits>

#include "core/math.h"
#include "methods/reprojection/key_frame.h"
#include "methods/reprojection/options.h"

namespace catoptric::methods::reprojection {

/// Positions this close to a sample (in samples) are moved onto it. Matches this close to the
/// key-frame position of the reflecting surface are moved there. Static parts thus stay
/// bit-identical. Not from the paper: moving a ramp from 0 to 1 over 5 samples by this distance
/// changes it by 0.02 / 5, about 1/255.
inline constexpr float kSnap = 0.02f;

/// Maximum number of search steps from each start (not from the paper). The median in the interior
/// test scenes is 2; 4 would suffice for all mappings except grid.
inline constexpr int kMostSearchSteps = 16;

/// Whether a sample's reflection was found in the key frame; if not, why.
enum class Outcome : std::uint8_t {
  NotAsked,  ///< the sample does not reflect
  Found,
  NotSearched,    ///< glossy or refractive, or this is a key frame
  NotFound,       ///< the search left the reflector or the buffers, or did not converge
  Hidden,         ///< perhaps behind a nearer surface, of which the key frame lacks this part
  Discontinuity,  ///< at an edge of the reflected scene or of the reflector
  Magnified,      ///< one sample would be stretched over too many
  Crossed,        ///< a moving object may now be in front
  Unfaithful,     ///< the stored point does not lie on the mirrored ray
  SecondBounce,   ///< no match in the second mirror, or a match that is off the reflected ray
};

/// A position in the key frame, in samples with integer centres.
struct Match {
  Vec2 place{0.0f};
  Outcome outcome = Outcome::NotAsked;
  /// If Found: KeyFrame::length() at `place`, infinite for the sky.
  float length = 0.0f;
  /// Distance from the ray, in samples, before the last correction; infinite: not measured.
  float miss = std::numeric_limits<float>::infinity();
};

/// The mirrored ray of a sample.
struct MirrorRay {
  Vec3 origin{0.0f};
  Vec3 direction{0.0f};         ///< unit length
  std::uint32_t reflector = 0;  ///< id
};

/// Minimizes the angle, starting at `start`. If the outcome is Found, `match.place` is accurate to
/// a hundredth of a sample.
Match search(const KeyFrame& key, const MirrorRay& ray, const Vec2& start, const Options& options);

/// The contents of the key frame at a position between samples.
struct Lookup {
  Vec3 radiance{0.0f};
  Vec4 place{0.0f};  ///< as KeyFrame::place()
  Outcome outcome = Outcome::Discontinuity;
};
/// Interpolates bilinearly if the four surrounding samples show one continuous surface in one
/// reflector. On a sample, that sample alone counts. Less than half a sample outside a silhouette,
/// the values are extrapolated.
Lookup lookUp(const KeyFrame& key, std::uint32_t reflector, const Vec2& place,
              const Options& options);

/// Distance of `place` (as KeyFrame::place()) from the mirrored ray, in samples of the key frame
/// around `at`; infinite if undefined.
float missBy(const KeyFrame& key, const MirrorRay& ray, const Vec2& at, const Vec4& place,
             const Options& options);

}  // namespace catoptric::methods::reprojection
