// Errors of a setting's frames against a reference. They are exact, so each is computed once and
// stored.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "report/comparison.h"

namespace catoptric::study {

/// The measure that also needs the frame before each frame.
inline constexpr const char* kFlicker = "flicker";

/// An error measure. For all of them, less is better.
struct MetricInfo {
  std::string name;
  std::string meaning;
};
/// The error measures that a study can use.
const std::vector<MetricInfo>& metrics();
/// Throws UsageError, with the nearest name, if there is no measure called `name`.
void requireMetric(const std::string& name);

struct FrameErrors {
  std::map<std::string, double> metrics;
  std::uint64_t reflectivePixels = 0;  ///< 0: none, or unknown
  std::uint64_t elsewherePixels = 0;   ///< the others; 0 also if reflectivePixels is unknown
  struct Part {
    std::uint64_t pixels = 0;
    std::uint64_t sum8 = 0;  ///< sum over R, G and B, in display steps
  };
  std::map<int, Part> objects;  ///< reflective pixels by object; empty without the layer `id`
  std::map<std::string, std::uint64_t> counters;
  std::string pixels;               ///< fingerprint of the pixels
  std::uint64_t flickerPixels = 0;  ///< pixels that the metric kFlicker counts
};

struct PointErrors {
  std::map<int, FrameErrors> frames;

  /// The error of these frames together: the maximum of max_8bit, the root mean square of rmse, the
  /// mean of all other measures. NaN if a frame is missing. The path's first frame has no kFlicker.
  double pooled(const std::string& metric, const std::vector<int>& ofFrames) const;
  /// The frame with the largest error; 0: none.
  int worstFrame(const std::string& metric, const std::vector<int>& ofFrames) const;
  /// The reference's own uncertainty in this error measure; 0: none is known.
  double uncertainty(const std::string& metric, const std::vector<int>& ofFrames) const;
  double meanCounter(const std::string& name, const std::vector<int>& ofFrames) const;
};

/// The errors of a frame that `comparison` has.
FrameErrors frameErrors(const report::RunComparison& comparison, int number);

/// Reads a file of PointErrors. A missing file yields an empty result.
PointErrors readErrors(const std::filesystem::path& file);
void writeErrors(const std::filesystem::path& file, const PointErrors& errors);

}  // namespace catoptric::study
