// Stability over time: how a sequence's error against its reference frames (the truth) changes from
// frame to frame. A constant error disturbs less than one that changes, so flicker is measured
// apart from the error.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "image/image.h"

namespace catoptric::measure {

/// E = frame - truth of each pixel in display steps (-255..255), and the layers that motion needs.
struct SignedError {
  int width = 0;
  int height = 0;
  std::vector<std::int16_t> steps;    ///< 3 per pixel; 255 where a value is not finite
  std::vector<std::uint8_t> counted;  ///< 1: the pixel is reflective; all are 1 if no layer tells
  bool hasReflective = false;
  std::vector<int> objects;  ///< layer id.object; empty without it
  std::set<int> reflectors;  ///< ids of reflective objects, see Classes::reflectors()
  /// What an exact frame's E could be, because the reference errs: from its layer standard_error, 3
  /// per pixel; empty without it.
  std::vector<std::int16_t> truthSteps;
  std::vector<float> distance;  ///< layer Z, metres; empty without it
  std::vector<float> motion;    ///< layers motion.X, .Y, .Z: 3 per pixel; empty without them
};

/// The signed error of a frame. Layers that the image lacks are taken from the reference. Throws
/// UsageError, which begins with `name`, if sizes differ or colours are missing.
SignedError signedError(const image::Image& image, const image::Image& reference,
                        const std::string& name = "image");

/// A mean of |E_t - E_t-1| over pixels and channels, in display steps.
struct Flicker {
  std::uint64_t pixels = 0;  ///< number of pixels, summed over all pairs of frames
  double sum = 0.0;
  double floorSum = 0.0;  ///< see floor()

  double mean() const;
  /// The flicker that exact frames would have, because the reference's own error changes.
  double floor() const;
};

/// Stability of a sequence. Only pairs of consecutive frames count.
struct MotionError {
  int pairs = 0;
  bool hasFloor = false;           ///< whether the reference has the layer standard_error
  std::vector<int> gaps;           ///< frames after a missing frame, or after one of another size
  bool hasReflective = false;      ///< whether only reflective pixels count
  Flicker all;                     ///< at fixed pixels that count in both frames
  std::map<int, Flicker> frames;   ///< by the later frame of a pair
  std::map<int, Flicker> objects;  ///< by reflector; pixels that show it in both frames
  bool hasMotion = false;          ///< whether the layers for alongMotion exist
  Flicker alongMotion;          ///< E_t-1 is read where the surface point was in the previous frame
  std::uint64_t unmatched = 0;  ///< pixels whose surface point was hidden or outside the previous
                                ///< frame, or whose motion is unknown
  /// Over each kWindow consecutive frames, the mean of E^2 is the square of the mean of E (steady)
  /// plus its variance (unsteady). Sums over pixels that count in all frames of the window.
  std::uint64_t windowPixels = 0;
  double steadySquared = 0.0;
  double unsteadySquared = 0.0;
  int worstFrame = 0;  ///< frame with the largest flicker; 0: no pairs
  int worstX = 0;  ///< middle of the tile of kTile x kTile pixels that flickers most in worstFrame,
                   ///< by the mean over its pixels in the frame
  int worstY = 0;
  double worstTile = 0.0;  ///< flicker of that tile, display steps

  static constexpr int kWindow = 8;  ///< frames; our choice
  static constexpr int kTile = 16;   ///< pixels; our choice

  double steady() const;    ///< root mean square, display steps
  double unsteady() const;  ///< the same
  /// Percent of the counted pixels that are `unmatched`.
  double unmatchedPercent() const;
};

/// Adds up the frames of a sequence.
class MotionMeter {
 public:
  /// Adds frame `number`. Frames come in increasing order. Returns the pair's |E_t - E_t-1| per
  /// pixel (mean of the channels; 0 where the pixel does not count); empty if there is no pair.
  std::vector<float> add(int number, SignedError error);
  const MotionError& result() const { return result_; }

 private:
  std::vector<float> addPair(int number, const SignedError& now);
  void addAlongMotion(const SignedError& now);
  void addToWindow(const SignedError& now);

  MotionError result_;
  std::optional<SignedError> last_;
  int lastNumber_ = 0;
  // The current window: per pixel, in how many frames it counted; per value, sums of E and E^2
  int windowFrames_ = 0;
  std::vector<std::uint8_t> windowCounts_;
  std::vector<std::int32_t> windowSums_;
  std::vector<std::int32_t> windowSquares_;
};

}  // namespace catoptric::measure
