// What the module catoptric_imageio hands to the program. It alone links OpenImageIO, OpenColorIO
// and OpenEXR. Functions report errors as text (empty: done), so that no exception type has to be
// the same on both sides of dlopen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"

namespace catoptric::image {

struct ImageIoApi {
  /// Grows with every change of this struct, of Image or of ExrOptions.
  int version;
  /// Prepares codecs and colour transforms with `threads` threads; safe to call once.
  std::string (*prepare)(int threads);
  /// Values are finite and within half's range already.
  std::string (*encodeExr)(const Image& image, const ExrOptions& options,
                           std::vector<std::byte>& bytes);
  /// Channels come back with R G B A first; more than `maxValues` floats are refused.
  std::string (*decodeExr)(std::span<const std::byte> bytes, std::size_t maxValues, Image& image);
  /// `rgb` holds finite scene-linear triples; `out` takes as many bytes.
  std::string (*display)(std::span<float> rgb, float exposureStops, std::span<std::uint8_t> out);
};

inline constexpr int kImageIoVersion = 1;
inline constexpr const char* kImageIoSymbol = "catoptricImageIo";

}  // namespace catoptric::image
