// Errors of images against references: what the papers report (display-referred, 0..255) and
// measures on the scene-linear values; per frame and pooled over a run.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "report/run_data.h"
#include "report/table.h"
#include "report/timings.h"

namespace catoptric::report {

/// Sums and extremes over R, G, B of one or more images. Values that are NaN or infinite, in the
/// image or its reference, are counted first; their pixels differ by the full 255 in display
/// values, and are left out of the linear measures, which then cover less.
struct ImageError {
  std::uint64_t pixels = 0;
  std::uint64_t notFinite = 0;           ///< pixels with NaN or infinity in the image
  std::uint64_t notFiniteReference = 0;  ///< and in the reference
  bool hasReflective = false;            ///< a layer said which pixels are reflective
  std::uint64_t reflectivePixels = 0;

  // Display-referred: steps of round(display8(value))
  std::uint64_t sum8 = 0;
  std::uint64_t sum8Reflective = 0;
  int max8 = 0;
  int max8Frame = 0;  ///< of pooled errors
  int max8X = -1;     ///< first pixel, by rows, that has the maximum; -1: no difference
  int max8Y = -1;

  // Scene-linear
  std::uint64_t linearValues = 0;
  double sumAbsolute = 0.0;
  double sumSquared = 0.0;
  double maxLinear = 0.0;
  int maxLinearX = -1;
  int maxLinearY = -1;
  double ssimSum = 0.0;  ///< of images
  int images = 0;

  /// Mean absolute difference per channel, 0..255, over all pixels (L1_8bit of the papers).
  double l1() const;
  /// The same over reflective pixels; 0 when there are none.
  double l1Reflective() const;
  double mae() const;
  double rmse() const;
  /// dB, against a peak of 1 (display white); infinite when nothing differs.
  double psnr() const;
  double ssim() const;
};

/// Compares R, G, B. Reflective are pixels whose layer mask.reflective (a share, 0..1) is above 0,
/// of the image or else of the reference; without it, those whose layer s is. Throws UsageError
/// when sizes differ or colours are missing; `name` begins the message.
ImageError compareImages(const image::Image& image, const image::Image& reference,
                         const std::string& name = "image");

/// Mean structural similarity of two grey images with a dynamic range of 1: Gaussian window of 11
/// and sigma 1.5, cut at the borders. [Wang2004, Image quality assessment] Eq. (13)
double ssim(std::span<const float> a, std::span<const float> b, int width, int height);

struct RunComparison {
  std::string name;
  std::string reference;
  std::map<int, ImageError> frames;
  ImageError pooled;
  std::vector<int> onlyInRun;        ///< frames that the reference lacks
  std::vector<int> onlyInReference;  ///< frames that the run lacks
};

/// All frames that both have, read from their EXR files. Throws UsageError when there are none.
RunComparison compareRuns(const RunData& run, const RunData& reference);

/// One comparison, frame by frame, and the pooled row.
Table errorView(const RunComparison& comparison);
/// A row for each comparison; with the mean time of its method and the ratio to its reference where
/// `timings` has them.
Table errorSummary(std::span<const RunComparison> comparisons,
                   std::span<const TimingTable> timings = {});
/// method,against,frame,...; the pooled row has the frame "all".
std::string errorCsv(std::span<const RunComparison> comparisons);
/// [{"method", "against", "frames": [...], "pooled": {...}, "only_in_run", "only_in_reference"}];
/// an infinite PSNR is null.
std::string errorJson(std::span<const RunComparison> comparisons);

/// |difference| in display steps times `gain`, 8-bit RGB; magenta where a value is not finite.
std::vector<std::uint8_t> differenceRgb8(const image::Image& image, const image::Image& reference,
                                         int gain);
/// Writes frame.0001.png and frame.0001.x50.png of all common frames into `folder`.
void writeDifferences(const RunData& run, const RunData& reference,
                      const std::filesystem::path& folder);

}  // namespace catoptric::report
