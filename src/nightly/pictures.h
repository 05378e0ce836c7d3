// Frames against the accepted ones, and the store in which those are kept.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "image/image.h"
#include "nightly/history.h"
#include "nightly/judge.h"

namespace catoptric::nightly {

/// Pixels with a value that is NaN or infinite in R, G or B.
std::uint64_t notFinitePixels(const image::Image& image);

struct PictureComparison {
  PictureErrors errors;
  std::map<int, double> reflectors;  ///< mean difference in display steps by object
  int tileX = 0;                     ///< left upper pixel of the worst tile
  int tileY = 0;
};
/// Throws UsageError when the sizes differ.
PictureComparison comparePictures(const image::Image& now, const image::Image& accepted);

/// Copies a frame into the store, where its name is the fingerprint of its bytes; written once.
/// Returns the name. Throws OutputError.
std::string storeFrame(const History& history, const std::filesystem::path& file);
std::filesystem::path storedFrame(const History& history, const std::string& object);

}  // namespace catoptric::nightly
