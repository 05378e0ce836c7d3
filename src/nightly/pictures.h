// Compares frames with the accepted ones, and stores accepted frames.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "image/image.h"
#include "nightly/history.h"
#include "nightly/judge.h"

namespace catoptric::nightly {

/// The number of pixels with NaN or infinity in R, G or B.
std::uint64_t notFinitePixels(const image::Image& image);

struct PictureComparison {
  PictureErrors errors;
  std::map<int, double> reflectors;  ///< mean difference in display steps, by object
  int tileX = 0;                     ///< upper left pixel of the worst tile
  int tileY = 0;
};
/// Throws UsageError if the sizes differ.
PictureComparison comparePictures(const image::Image& now, const image::Image& accepted);

/// Copies a frame into the store, unless it is there already, and returns its name, which is the
/// fingerprint of its bytes. Throws OutputError.
std::string storeFrame(const History& history, const std::filesystem::path& file);
std::filesystem::path storedFrame(const History& history, const std::string& object);

}  // namespace catoptric::nightly
