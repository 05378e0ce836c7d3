// Pictures of the errors of a frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "measure/errors.h"
#include "report/figure.h"

namespace catoptric::report {

/// What pictures are made of; the references live as long as it.
struct FrameErrors {
  const image::Image& image;
  const image::Image& reference;
  const measure::ErrorMaps& maps;
  const measure::ImageError& errors;
  int frame = 0;
  std::string name;           ///< of the run
  std::string referenceName;  ///< of what it is compared with
};

/// |difference| in display steps times `gain`, 8-bit RGB; magenta where a value is not finite.
std::vector<std::uint8_t> differenceRgb8(const image::Image& image, const image::Image& reference,
                                         int gain);
/// A map of errors 0..1 in FLIP's colours; the bar below it has those of 0 (left) to 1.
Rgb8 heatMap(const std::vector<float>& errors, int width, int height);
/// Image, reference, difference x50; difference, LDR-FLIP, HDR-FLIP: with titles and figures.
Figure sideBySide(const FrameErrors& frame);
/// Writes frame.0001.png (difference), .x50.png, .flip.png, .hdrflip.png and .sheet.png into
/// `folder`. Throws OutputError.
void writeDifferences(const FrameErrors& frame, const std::filesystem::path& folder);

}  // namespace catoptric::report
