#include "report/differences.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/file.h"
#include "measure/colours.h"
#include "measure/display_steps.h"
#include "measure/flip.h"
#include "report/table.h"

namespace catoptric::report {
namespace {

using image::Image;
using measure::step8;

constexpr int kBarHeight = 12;

/// The frame in display steps, magenta where it is not finite.
Rgb8 shown(const Image& image) {
  const std::array<int, 3> channels = measure::colourChannels(image, "image");
  Rgb8 picture{image.width, image.height, {}};
  picture.rgb.reserve(image.pixelCount() * 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      Colour pixel{};
      for (std::size_t c = 0; c < 3; ++c) {
        const float v = image.at(x, y, channels[c]);
        if (!std::isfinite(v)) {
          pixel = {255, 0, 255};
          break;
        }
        pixel[c] = static_cast<std::uint8_t>(step8(v));
      }
      picture.rgb.insert(picture.rgb.end(), pixel.begin(), pixel.end());
    }
  return picture;
}

}  // namespace

std::vector<std::uint8_t> differenceRgb8(const Image& image, const Image& reference, int gain) {
  measure::requireSameSize(image, reference, "difference");
  const std::array<int, 3> from = measure::colourChannels(image, "difference");
  const std::array<int, 3> to = measure::colourChannels(reference, "difference (reference)");
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.pixelCount() * 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      Colour pixel{};
      bool finite = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const float a = image.at(x, y, from[c]);
        const float b = reference.at(x, y, to[c]);
        finite = finite && std::isfinite(a) && std::isfinite(b);
        if (finite)
          pixel[c] = static_cast<std::uint8_t>(std::min(255, gain * std::abs(step8(a) - step8(b))));
      }
      if (!finite) pixel = {255, 0, 255};
      rgb.insert(rgb.end(), pixel.begin(), pixel.end());
    }
  return rgb;
}

Rgb8 heatMap(const std::vector<float>& errors, int width, int height) {
  Rgb8 picture{width, height + kBarHeight, {}};
  picture.rgb.reserve(static_cast<std::size_t>(picture.width) * picture.height * 3);
  const auto add = [&](long step) {
    const Colour c = measure::magma(static_cast<float>(step) / 255.0f);
    picture.rgb.insert(picture.rgb.end(), c.begin(), c.end());
  };
  for (const float e : errors) add(std::lround(255.0f * e));
  for (int i = 0; i < kBarHeight * width; ++i) add(255L * (i % width) / std::max(1, width - 1));
  return picture;
}

Figure sideBySide(const FrameErrors& frame) {
  const int width = frame.image.width;
  const int height = frame.image.height;
  const measure::ImageError& e = frame.errors;
  const auto difference = [&](int gain) {
    return Rgb8{width, height, differenceRgb8(frame.image, frame.reference, gain)};
  };
  Figure figure{frame.name + " against " + frame.referenceName + ", frame " +
                    std::to_string(frame.frame) + ", RMSE " + fixedText(e.rmse(), 5) + ", SSIM " +
                    fixedText(e.ssim(), 4),
                {},
                true};
  figure.rows.push_back({"",
                         {{frame.name, shown(frame.image)},
                          {frame.referenceName, shown(frame.reference)},
                          {"difference x50, L1_8bit " + fixedText(e.l1(), 3), difference(50)}}});
  figure.rows.push_back(
      {"",
       {{"difference, max " + std::to_string(e.max8), difference(1)},
        {"LDR-FLIP " + fixedText(e.flip(), 4), heatMap(frame.maps.flip, width, height)},
        {"HDR-FLIP " + fixedText(e.hdrFlip(), 4), heatMap(frame.maps.hdrFlip, width, height)}}});
  return figure;
}

Figure filmFrame(const FrameErrors& frame) {
  return {fmt::format("{} against {}, frame {:04}", frame.name, frame.referenceName, frame.frame),
          {{"", {{frame.name, shown(frame.image)}, {frame.referenceName, shown(frame.reference)}}}},
          true};
}

Rgb8 changeMap(const std::vector<float>& changes, int width) {
  std::vector<float> shares;
  shares.reserve(changes.size());
  for (const float change : changes) shares.push_back(std::min(1.0f, change / kMostChange));
  return heatMap(shares, width, static_cast<int>(changes.size()) / width);
}

void writeChanges(const std::vector<float>& changes, int width, int frame,
                  const std::filesystem::path& folder) {
  const Rgb8 picture = changeMap(changes, width);
  writeFileAtomically(folder / fmt::format("frame.{:04}.change.png", frame),
                      image::encodePng(picture.width, picture.height, 3, picture.rgb));
}

void writeDifferences(const FrameErrors& frame, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(folder.string() + ": cannot be created: " + error.message());
  const auto write = [&](const char* extension, int width, int height,
                         std::span<const std::uint8_t> rgb) {
    writeFileAtomically(folder / fmt::format("frame.{:04}{}", frame.frame, extension),
                        image::encodePng(width, height, 3, rgb));
  };
  const int width = frame.image.width;
  const int height = frame.image.height;
  for (const auto& [gain, extension] : {std::pair{1, ".png"}, std::pair{50, ".x50.png"}})
    write(extension, width, height, differenceRgb8(frame.image, frame.reference, gain));
  for (const auto& [map, extension] :
       {std::pair{&frame.maps.flip, ".flip.png"}, std::pair{&frame.maps.hdrFlip, ".hdrflip.png"}}) {
    const Rgb8 picture = heatMap(*map, width, height);
    write(extension, picture.width, picture.height, picture.rgb);
  }
  const std::filesystem::path sheet = folder / fmt::format("frame.{:04}.sheet.png", frame.frame);
  writeFileAtomically(sheet, drawFigure(sideBySide(frame), sheet));
}

}  // namespace catoptric::report
