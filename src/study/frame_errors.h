// Errors of a setting's frames against a reference: exact, so that each is computed once and kept.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "report/comparison.h"

namespace catoptric::study {

/// Measures that a study can judge by: less is better, for all of them.
const std::vector<std::string>& metricNames();
/// Throws UsageError with the nearest name.
void requireMetric(const std::string& name);

/// Of one frame.
struct FrameErrors {
  std::map<std::string, double> metrics;
  std::uint64_t reflectivePixels = 0;  ///< 0: none, or unknown
  struct Part {
    std::uint64_t pixels = 0;
    std::uint64_t sum8 = 0;  ///< of R, G and B, in display steps
  };
  std::map<int, Part> objects;  ///< reflective pixels by object; with the layer `id` alone
  std::map<std::string, std::uint64_t> counters;
  std::string pixels;  ///< fingerprint
};

struct PointErrors {
  std::map<int, FrameErrors> frames;

  /// Over these frames together; NaN when one is missing. Largest of max_8bit, root mean square of
  /// rmse, mean of all others.
  double pooled(const std::string& metric, const std::vector<int>& ofFrames) const;
  /// The frame with the largest error; 0: none.
  int worstFrame(const std::string& metric, const std::vector<int>& ofFrames) const;
  double meanCounter(const std::string& name, const std::vector<int>& ofFrames) const;
};

FrameErrors frameErrors(const measure::ImageError& error);

/// A file of PointErrors. Reading one that is not there gives none.
PointErrors readErrors(const std::filesystem::path& file);
void writeErrors(const std::filesystem::path& file, const PointErrors& errors);

}  // namespace catoptric::study
