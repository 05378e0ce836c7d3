// EXR files in memory; for the sources of this folder only: image.h checks what goes in and out.
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

/// Values are finite and within half's range already. Throws std::exception.
std::vector<std::byte> writeExr(const Image& image, const ExrOptions& options);
/// Channels come back with R G B A first; more than `maxValues` floats are refused. Throws
/// std::exception.
Image readExr(std::span<const std::byte> bytes, std::size_t maxValues);

}  // namespace catoptric::image
