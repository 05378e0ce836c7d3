// Images in memory and their files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace catoptric::image {

/// Float channels, interleaved, row 0 at the top. data.size() == width * height * channels.size().
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< "R", "G", "B", "A", "Z", "reflection.R", ...
  std::vector<float> data;

  std::size_t pixelCount() const { return static_cast<std::size_t>(width) * height; }
  /// Index of a channel; -1 when absent.
  int channel(const std::string& name) const;
  float at(int x, int y, int c) const {
    return data[(static_cast<std::size_t>(y) * width + x) * channels.size() + c];
  }
};

enum class Compression { None, Zip, Piz };

struct ExrOptions {
  Compression compression = Compression::Zip;
  int zipLevel = 4;
  bool halfBeauty = true;  ///< R G B A as half; data layers are always float
  /// String, number and matrix attributes: worldToCamera (16 floats) and so on.
  std::map<std::string, std::string> text;
  std::map<std::string, float> numbers;
  std::map<std::string, std::vector<float>>
      matrices;  ///< 16 floats each, row-vector convention of EXR
};

struct ExrStatistics {
  std::size_t clampedHalf = 0;  ///< values beyond 65504 in half channels, clamped to it
};

/// Encodes to memory; deterministic bytes (DateTime is fixed). Throws OutputError.
std::vector<std::byte> encodeExr(const Image& image, const ExrOptions& options,
                                 ExrStatistics* statistics = nullptr);
/// Reads all pixels of an EXR or HDR file. Throws SceneError naming the file.
Image readImage(const std::filesystem::path& file);

/// 8-bit gray, RGB or RGBA PNG marked as sRGB (libpng); rows from the top,
/// no padding. Deterministic. Throws OutputError.
std::vector<std::byte> encodePng(int width, int height, int channels,
                                 std::span<const std::uint8_t> pixels);

/// 8-bit RGBA, row 0 at the top.
struct Image8 {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;
};
/// 8-bit RGBA from PNG or JPEG bytes (libpng, libjpeg-turbo; recognised by content): any bit depth,
/// palette, gray, interlaced or progressive; CMYK without its profile. Gamma, profiles and Exif
/// orientation are ignored, as glTF has it. `maxPixels` caps the size before anything is allocated.
/// Truncated or damaged files are errors. Throws SceneError beginning with `name`.
Image8 decodeImage8(std::span<const std::byte> bytes, const std::string& name,
                    std::size_t maxPixels);

/// Scene-linear Rec.709 R G B of `image` to display-referred 8-bit RGB through OpenColorIO (our
/// small config: exposure, sRGB view). NaN shows as magenta, never as black.
std::vector<std::uint8_t> displayRgb8(const Image& image, float exposureStops = 0.0f);

/// The same sRGB encoding of one linear value without OpenColorIO, 0..255, clamped: what L1_8bit
/// compares (rounded). NaN stays NaN. Tests hold both to the same result within half a step.
float display8(float linear);

}  // namespace catoptric::image
