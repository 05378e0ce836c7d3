// Checks what goes into EXR files and comes out of them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <new>

#include "core/error.h"
#include "core/file.h"
#include "image/checks.h"
#include "image/exr.h"
#include "image/hdr.h"

namespace catoptric::image {
namespace {

/// The largest finite half.
constexpr float kMaxHalf = 65504.0f;
/// What readImage allocates at most: 2 GiB of floats, an environment of 16384 x 8192 RGBA.
constexpr std::size_t kMaxValues = std::size_t{1} << 29;

/// The bits of the largest magnitude, which order as the magnitudes do, then infinity, then NaN.
std::uint32_t largestBits(const Image& image) {
  std::uint32_t largest = 0;
  for (const float value : image.data)
    largest = std::max(largest, std::bit_cast<std::uint32_t>(value) & 0x7FFFFFFFu);
  return largest;
}

/// For an image that has one: throws FrameError for the first NaN or infinity.
[[noreturn]] void refuseNotFinite(const Image& image) {
  const std::size_t count = image.channels.size();
  std::size_t i = 0;
  while (std::isfinite(image.data[i])) ++i;
  const std::size_t pixel = i / count;
  throw FrameError("channel " + image.channels[i % count] + " has " +
                   (std::isnan(image.data[i]) ? "NaN" : "an infinity") + " at pixel (" +
                   std::to_string(pixel % image.width) + ", " +
                   std::to_string(pixel / image.width) + "); such a frame is not written");
}

}  // namespace

std::vector<std::byte> encodeExr(const Image& image, const ExrOptions& options,
                                 ExrStatistics* statistics) {
  requireWellFormed(image);
  const std::uint32_t largest = largestBits(image);
  if (largest >= std::bit_cast<std::uint32_t>(std::numeric_limits<float>::infinity()))
    refuseNotFinite(image);
  if (options.zipLevel < 1 || options.zipLevel > 9)
    throw OutputError("EXR zip level " + std::to_string(options.zipLevel) + ": 1 to 9 are allowed");
  for (const auto& [name, values] : options.matrices)
    if (values.size() != 16)
      throw OutputError("EXR attribute " + name + ": a matrix has 16 numbers, not " +
                        std::to_string(values.size()));

  // Clamp what half cannot hold, and count it: no infinity may come out of the conversion
  ExrStatistics counted;
  Image clamped;
  const Image* source = &image;
  if (options.halfBeauty && largest > std::bit_cast<std::uint32_t>(kMaxHalf)) {
    const std::size_t count = image.channels.size();
    for (std::size_t c = 0; c < count; ++c) {
      if (!isBeauty(image.channels[c])) continue;
      for (std::size_t i = c; i < image.data.size(); i += count) {
        if (std::fabs(image.data[i]) <= kMaxHalf) continue;
        if (counted.clampedHalf++ == 0) {
          clamped = image;
          source = &clamped;
        }
        clamped.data[i] = std::copysign(kMaxHalf, image.data[i]);
      }
    }
  }

  if (statistics != nullptr) *statistics = counted;
  try {
    return writeExr(*source, options);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw OutputError("EXR of " + describe(image) + ": " + error.what());
  }
}

Image readImage(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = readFile(file);
  if (isHdr(bytes)) return decodeHdr(bytes, file.string(), kMaxValues);
  constexpr std::byte kExrMagic[] = {std::byte{0x76}, std::byte{0x2F}, std::byte{0x31},
                                     std::byte{0x01}};
  if (bytes.size() < 4 || !std::equal(std::begin(kExrMagic), std::end(kExrMagic), bytes.begin()))
    throw SceneError(file.string() + ": neither an EXR nor a Radiance HDR image (" +
                     std::to_string(bytes.size()) + " bytes)");
  try {
    return readExr(bytes, kMaxValues);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw SceneError(file.string() + ": bad EXR image: " + error.what());
  }
}

}  // namespace catoptric::image
