// Errors of images against references: what the papers report (display-referred, 0..255) and
// measures on the scene-linear values; per frame and pooled over a run.
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

/// Sums and extremes over R, G, B of pixels: of a frame, of its reflective part, of an object.
/// Values that are NaN or infinite, in the image or its reference, are counted first; their pixels
/// differ by the full 255 in display values and by 1 in FLIP, are over every threshold, and are
/// left out of the linear measures, which then cover less.
struct RegionError {
  std::uint64_t pixels = 0;
  std::uint64_t notFinite = 0;           ///< pixels with NaN or infinity in the image
  std::uint64_t notFiniteReference = 0;  ///< and in the reference
  std::uint64_t bothBlack = 0;           ///< pixels that are 0 in both: they agree on nothing

  // Display-referred: steps of round(display8(value))
  std::uint64_t sum8 = 0;
  int max8 = 0;
  int max8Frame = 0;  ///< of pooled errors
  int max8X = -1;     ///< first pixel, by rows, that has the maximum; -1: no difference
  int max8Y = -1;

  // Scene-linear
  std::uint64_t linearValues = 0;
  double sumAbsolute = 0.0;
  double sumSquared = 0.0;
  double sumRelative = 0.0;
  double sumLargest = 0.0;  ///< of each pixel's largest difference of a channel
  double maxLinear = 0.0;
  int maxLinearFrame = 0;
  int maxLinearX = -1;
  int maxLinearY = -1;
  std::uint64_t over = 0;  ///< pixels with a channel that differs by more than the threshold

  // Maps
  double ssimSum = 0.0;
  double flipSum = 0.0;  ///< LDR-FLIP
  double hdrFlipSum = 0.0;
  float flipMax = 0.0f;
  float hdrFlipMax = 0.0f;

  /// Mean absolute difference per channel, 0..255, over all pixels (L1_8bit of the papers).
  double l1() const;
  double mae() const;
  double rmse() const;
  /// Mean of (difference)^2 / (reference^2 + 0.01). [Rousselle2011] Sec. 5
  double relMse() const;
  /// dB, against a peak of 1 (display white); infinite when nothing differs.
  double psnr() const;
  double ssim() const;
  double flip() const;
  double hdrFlip() const;
  double overPercent() const;
  double meanLargest() const;
  /// Nothing is shown on either side: that all errors are 0 says nothing.
  bool isBlack() const { return pixels > 0 && bothBlack == pixels; }
};

/// Values of a FLIP map by their size, for the pooled values of FLIP's own tool.
class FlipPool {
 public:
  void add(std::span<const float> map);
  void add(const FlipPool& other);
  /// The value below which errors make up `share` (0..1) of the sum of all errors; to 1/4096.
  double weightedQuantile(double share) const;
  double min() const { return count_ > 0 ? min_ : 0.0; }

 private:
  static constexpr int kBins = 4096;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(kBins + 1);
  std::uint64_t count_ = 0;
  double min_ = 1.0;
};

/// Errors of one image, or of all frames together; the base is the whole frame.
struct ImageError : RegionError {
  bool hasReflective = false;  ///< a layer said which pixels are reflective
  RegionError reflective;
  std::map<int, RegionError> objects;  ///< reflective pixels by the layer id.object
  /// mask.* layers, silhouettes (edges of id.object), glossy, other reflective pixels, the rest.
  std::vector<ErrorClass> classes;
  FlipPool flipPool;
  FlipPool hdrFlipPool;

  /// L1_8bit over reflective pixels; 0 when there are none.
  double l1Reflective() const { return reflective.l1(); }
};

struct CompareOptions {
  double threshold = 0.01;  ///< scene-linear, per channel, of RegionError::over
  /// `over`, `sumLargest`, `maxLinear` and `notFinite` are of A, too, and differences of values
  /// above 1 relative to the larger one.
  bool forLimits = false;
  FlipOptions flip;
};

/// Errors of the pixels.
struct ErrorMaps {
  std::vector<float> flip;
  std::vector<float> hdrFlip;
};

/// Compares R, G, B (or r, g, b; those of the only layer; Y). Reflective are pixels whose layer
/// mask.reflective (a share, 0..1) is above 0, of the image or else of the reference; without it,
/// those whose layer s is. Throws UsageError when sizes differ or colours are missing; `name`
/// begins the message.
ImageError compareImages(const image::Image& image, const image::Image& reference,
                         const std::string& name = "image", const CompareOptions& options = {},
                         ErrorMaps* maps = nullptr);

/// Adds the errors of frame `frame` to those of others.
void addErrors(ImageError& pooled, const ImageError& one, int frame);

}  // namespace catoptric::measure
