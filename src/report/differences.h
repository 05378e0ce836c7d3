// Pictures of the errors of a frame.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/errors.h"
#include "report/font.h"

namespace catoptric::report {

/// Indices of the colours of an image, as compareImages chooses them. Throws UsageError.
std::array<int, 3> colourChannels(const image::Image& image, const std::string& name);
/// Throws UsageError when sizes differ.
void requireSameSize(const image::Image& image, const image::Image& reference,
                     const std::string& name);
/// The display step 0..255 of a scene-linear value: round(display8(value)); NaN gives 0.
int step8(float value);

/// What pictures are made of; the references live as long as it.
struct FrameErrors {
  const image::Image& image;
  const image::Image& reference;
  const ErrorMaps& maps;
  const ImageError& errors;
  int frame = 0;
  std::string name;           ///< of the run
  std::string referenceName;  ///< of what it is compared with
};

/// |difference| in display steps times `gain`, 8-bit RGB; magenta where a value is not finite.
std::vector<std::uint8_t> differenceRgb8(const image::Image& image, const image::Image& reference,
                                         int gain);
/// A map of errors 0..1 in FLIP's colours, with a colour bar and its numbers below.
Rgb8 heatMap(const std::vector<float>& errors, int width, int height);
/// Image, reference, difference x50; difference, LDR-FLIP, HDR-FLIP: with titles and figures.
Rgb8 sideBySide(const FrameErrors& frame);
/// Writes frame.0001.png (difference), .x50.png, .flip.png, .hdrflip.png and .sheet.png into
/// `folder`. Throws OutputError.
void writeDifferences(const FrameErrors& frame, const std::filesystem::path& folder);

}  // namespace catoptric::report
