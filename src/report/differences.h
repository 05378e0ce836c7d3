// Pictures of a frame's errors.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "measure/errors.h"
#include "report/figure.h"

namespace catoptric::report {

/// The data for pictures of one frame. The referenced objects must outlive it.
struct FrameErrors {
  const image::Image& image;
  const image::Image& reference;
  const measure::ErrorMaps& maps;
  const measure::ImageError& errors;
  int frame = 0;
  std::string name;           ///< name of the run
  std::string referenceName;  ///< name of the run that it is compared with
};

/// |difference| in display steps times `gain`, as 8-bit RGB; magenta where a value is not finite.
std::vector<std::uint8_t> differenceRgb8(const image::Image& image, const image::Image& reference,
                                         int gain);
/// A map of errors 0..1 in FLIP's colours. A bar below it shows the colours from 0 (left) to 1.
Rgb8 heatMap(const std::vector<float>& errors, int width, int height);
/// A sheet with titles and figures. First row: image, reference, difference x50. Second row:
/// difference, LDR-FLIP, HDR-FLIP.
Figure sideBySide(const FrameErrors& frame);
/// The first panels of a film's frame: image and reference. changeMap() is the last one.
Figure filmFrame(const FrameErrors& frame);
/// By how many display steps the error of each pixel differs from the frame before, as a heat map
/// from 0 to kMostChange.
Rgb8 changeMap(const std::vector<float>& changes, int width);
/// Writes frame.0001.change.png: changeMap(). Throws OutputError.
void writeChanges(const std::vector<float>& changes, int width, int frame,
                  const std::filesystem::path& folder);
inline constexpr float kMostChange = 32.0f;
/// Writes frame.0001.png (the difference), .x50.png, .flip.png, .hdrflip.png and .sheet.png to
/// `folder`. Throws OutputError.
void writeDifferences(const FrameErrors& frame, const std::filesystem::path& folder);

}  // namespace catoptric::report
