// Encodes and decodes EXR files in memory; private. image.h checks inputs and outputs.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"

namespace catoptric::image {

inline bool isBeauty(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A";
}

/// Values must already be finite and within the range of half. Throws std::exception.
std::vector<std::byte> writeExr(const Image& image, const ExrOptions& options);
/// Returns the channels with R G B A first. Refuses files with more than `maxValues` floats. Throws
/// std::exception.
Image readExr(std::span<const std::byte> bytes, std::size_t maxValues);

}  // namespace catoptric::image
