// Errors of images against references, per frame and pooled over a run: the display-referred errors
// (0..255) that the papers report, and errors of scene-linear values.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "measure/error_classes.h"
#include "measure/flip.h"

namespace catoptric::measure {

/// Sums and extremes over R, G, B of a set of pixels: of a frame, of its reflective pixels, or of
/// an object. Pixels with NaN or infinity, in the image or the reference, are counted separately.
/// They differ by the full 255 in display values and by 1 in FLIP, and exceed every threshold. The
/// linear measures leave them out.
struct RegionError {
  std::uint64_t pixels = 0;
  std::uint64_t notFinite = 0;           ///< pixels with NaN or infinity in the image
  std::uint64_t notFiniteReference = 0;  ///< pixels with NaN or infinity in the reference
  std::uint64_t bothBlack = 0;  ///< pixels that are 0 in both; their agreement proves nothing

  // Display-referred: differences of 8-bit sRGB values, round(display8(value))
  std::uint64_t sum8 = 0;
  int max8 = 0;
  int max8Frame = 0;  ///< frame of the maximum, for pooled errors
  int max8X = -1;     ///< first pixel, row by row, with the maximum; -1: no difference
  int max8Y = -1;

  // Scene-linear
  std::uint64_t linearValues = 0;
  double sumAbsolute = 0.0;
  double sumSquared = 0.0;
  double sumRelative = 0.0;
  double sumLargest = 0.0;  ///< sum over pixels of the largest difference of a channel
  double maxLinear = 0.0;
  int maxLinearFrame = 0;
  int maxLinearX = -1;
  int maxLinearY = -1;
  std::uint64_t over = 0;  ///< pixels in which a channel differs by more than the threshold

  // The reference's own layers, see ImageError
  double sumStandardError = 0.0;
  std::uint64_t sumOneBounce8 = 0;  ///< differences from the reference's picture with one bounce
  std::uint64_t sumBounces8 = 0;    ///< differences between the reference's two pictures

  // Sums of error maps
  double ssimSum = 0.0;
  double flipSum = 0.0;  ///< LDR-FLIP
  double hdrFlipSum = 0.0;
  float flipMax = 0.0f;
  float hdrFlipMax = 0.0f;

  /// Mean absolute difference per channel, 0..255 (the papers' L1_8bit).
  double l1() const;
  /// The expected L1_8bit of the reference itself against the truth.
  double standardError() const;
  /// L1_8bit against the reference's picture with one bounce.
  double l1OneBounce() const;
  /// L1_8bit of the reference's picture with one bounce against that with all: what further bounces
  /// are worth.
  double l1Bounces() const;
  double mae() const;
  double rmse() const;
  /// Mean of (difference)^2 / (reference^2 + 0.01). [Rousselle2011] Sec. 5
  double relMse() const;
  /// dB, relative to a peak of 1 (display white); infinite if nothing differs.
  double psnr() const;
  double ssim() const;
  double flip() const;
  double hdrFlip() const;
  double overPercent() const;
  double meanLargest() const;
  /// Whether image and reference are both entirely black: errors of 0 then prove nothing.
  bool isBlack() const { return pixels > 0 && bothBlack == pixels; }
};

/// A histogram of the values of FLIP maps, for the pooled values that FLIP's own tool reports.
class FlipPool {
 public:
  void add(std::span<const float> map);
  void add(const FlipPool& other);
  /// The value below which errors make up the fraction `share` (0..1) of the sum of all errors,
  /// accurate to 1/4096.
  double weightedQuantile(double share) const;
  double min() const { return count_ > 0 ? min_ : 0.0; }

 private:
  static constexpr int kBins = 4096;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(kBins + 1);
  std::uint64_t count_ = 0;
  double min_ = 1.0;
};

/// The errors of one image, or of all frames together. The base class has the errors of the whole
/// frame.
struct ImageError : RegionError {
  bool hasReflective = false;  ///< whether a layer told which pixels are reflective
  RegionError reflective;
  RegionError elsewhere;  ///< the other pixels
  /// Whether the reference has the layers `standard_error` and `one_bounce`, which the method
  /// `reference` writes.
  bool hasStandardError = false;
  bool hasOneBounce = false;
  std::map<int, RegionError> objects;  ///< errors of reflective pixels, by the layer id.object
  /// mask.* layers, silhouettes (edges of id.object), glossy, other reflective pixels, the rest.
  std::vector<ErrorClass> classes;
  FlipPool flipPool;
  FlipPool hdrFlipPool;

  /// L1_8bit over reflective pixels; 0 if there are none.
  double l1Reflective() const { return reflective.l1(); }
  /// Whether the image is at least as exact as the reference: its error is not above the
  /// reference's standard error, so that their difference may be that of the reference alone.
  bool withinUncertainty() const { return hasStandardError && l1() <= standardError(); }
};

struct CompareOptions {
  double threshold = 0.01;  ///< for RegionError::over: scene-linear, per channel
  /// Whether `over`, `sumLargest`, `maxLinear` and `notFinite` include channel A, and differences
  /// of values above 1 are relative to the larger value.
  bool forLimits = false;
  FlipOptions flip;
};

/// The error of each pixel.
struct ErrorMaps {
  std::vector<float> flip;
  std::vector<float> hdrFlip;
};

/// Compares R, G, B (or r, g, b; or the colours of the only layer; or Y). A pixel is reflective if
/// its layer mask.reflective (a fraction, 0..1) is above 0; without this layer, if its layer s is
/// above 0. The layer of the image is used, otherwise that of the reference. Throws UsageError if
/// sizes differ or colours are missing; the message begins with `name`.
ImageError compareImages(const image::Image& image, const image::Image& reference,
                         const std::string& name = "image", const CompareOptions& options = {},
                         ErrorMaps* maps = nullptr);

/// sum / count; 0 if there is nothing to divide by.
double quotient(double sum, double count);

/// Adds the errors of frame `frame` to the pooled errors.
void addErrors(ImageError& pooled, const ImageError& one, int frame);

}  // namespace catoptric::measure
