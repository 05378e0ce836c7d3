// Checks what goes into EXR files and comes out of them.
#include <algorithm>
#include <cmath>
#include <exception>
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

/// Throws FrameError for the first NaN or infinity.
void requireFinite(const Image& image) {
  const std::size_t count = image.channels.size();
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    if (std::isfinite(image.data[i])) continue;
    const std::size_t pixel = i / count;
    throw FrameError("channel " + image.channels[i % count] + " has " +
                     (std::isnan(image.data[i]) ? "NaN" : "an infinity") + " at pixel (" +
                     std::to_string(pixel % image.width) + ", " +
                     std::to_string(pixel / image.width) + "); such a frame is not written");
  }
}

}  // namespace

std::vector<std::byte> encodeExr(const Image& image, const ExrOptions& options,
                                 ExrStatistics* statistics) {
  requireWellFormed(image);
  requireFinite(image);
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
  if (options.halfBeauty) {
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
