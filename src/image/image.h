// Images in memory and their file formats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace catoptric::image {

/// An image of float channels, interleaved, row 0 at the top. Size: width * height *
/// channels.size().
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< "R", "G", "B", "A", "Z", "reflection.R", ...
  std::vector<float> data;

  std::size_t pixelCount() const { return static_cast<std::size_t>(width) * height; }
  /// Index of a channel; -1 if absent.
  int channel(const std::string& name) const;
  float at(int x, int y, int c) const {
    return data[(static_cast<std::size_t>(y) * width + x) * channels.size() + c];
  }
};

enum class Compression { None, Zip, Piz };

struct ExrOptions {
  Compression compression = Compression::Zip;
  int zipLevel = 4;
  bool halfBeauty = true;  ///< write R G B A as half; data layers are always float
  /// String, number and matrix attributes, e.g. worldToCamera (16 floats).
  std::map<std::string, std::string> text;
  std::map<std::string, float> numbers;
  std::map<std::string, std::vector<float>>
      matrices;  ///< 16 floats each, in EXR's row-vector convention
};

struct ExrStatistics {
  std::size_t clampedHalf = 0;  ///< values beyond 65504 in half channels, which were clamped
};

/// Encodes to memory. The bytes are deterministic (DateTime is fixed). Throws OutputError.
std::vector<std::byte> encodeExr(const Image& image, const ExrOptions& options,
                                 ExrStatistics* statistics = nullptr);
/// Reads all pixels of an EXR or HDR file. Throws SceneError, which names the file.
Image readImage(const std::filesystem::path& file);

/// Encodes an 8-bit grey, RGB or RGBA PNG that is marked as sRGB (libpng). Rows start at the top
/// and have no padding. Deterministic. Throws OutputError.
std::vector<std::byte> encodePng(int width, int height, int channels,
                                 std::span<const std::uint8_t> pixels);

/// An 8-bit RGBA image, row 0 at the top.
struct Image8 {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;
};
/// Decodes PNG or JPEG bytes to 8-bit RGBA (libpng, libjpeg-turbo). The contents determine the
/// format. Accepts any bit depth, palettes, grey, interlaced and progressive files, and CMYK, whose
/// profile is ignored. Gamma, other profiles and Exif orientation are ignored too, as glTF
/// requires. `maxPixels` limits the size before anything is allocated. Truncated or damaged files
/// are errors. Throws SceneError, which begins with `name`.
Image8 decodeImage8(std::span<const std::byte> bytes, const std::string& name,
                    std::size_t maxPixels);

/// How pictures are shown: by a view of an OpenColorIO config.
struct DisplayView {
  std::filesystem::path config;  ///< empty: the built-in one
  std::string view;              ///< empty: the config's default; of the built-in one sRGB
  float exposureStops = 0.0f;
  auto operator<=>(const DisplayView&) const = default;  // NOLINT(modernize-use-nullptr)
};
/// The built-in view that also shows radiance above 1; up to 0.8 it is sRGB.
inline constexpr const char* kNeutralView = "Neutral";
/// Identifies what a view does, with the contents of all its files. Throws UsageError if the config
/// cannot be used or has no such view; it then lists the views.
std::string viewFingerprint(const DisplayView& view);

/// Converts scene-linear Rec.709 R G B of `image` to display-referred 8-bit RGB with OpenColorIO.
/// NaN becomes magenta, never black.
std::vector<std::uint8_t> displayRgb8(const Image& image, const DisplayView& view = {});

/// Encodes one linear value as displayRgb8() does, but without OpenColorIO: 0..255, clamped.
/// L1_8bit compares these values, rounded. NaN stays NaN. Tests check that both functions agree
/// within half a step.
float display8(float linear);

}  // namespace catoptric::image
