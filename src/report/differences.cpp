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

constexpr int kPanelGap = 8;
constexpr int kBarHeight = 16;

Rgb8 blank(int width, int height) {
  Rgb8 picture{width, height, {}};
  picture.rgb.resize(static_cast<std::size_t>(width) * height * 3);
  fillRectangle(picture, 0, 0, width, height, kPaper);
  return picture;
}

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

Rgb8 mapColours(const std::vector<float>& errors, int width, int height) {
  std::array<Colour, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] = measure::magma(static_cast<float>(i) / 255.0f);
  Rgb8 picture{width, height, {}};
  picture.rgb.reserve(errors.size() * 3);
  for (const float e : errors) {
    const Colour& c = table[static_cast<std::size_t>(std::lround(255.0f * e))];
    picture.rgb.insert(picture.rgb.end(), c.begin(), c.end());
  }
  return picture;
}

/// The larger size of letters, if `text` has room in `width` with it.
int scaleFor(const std::string& text, int width) {
  return textWidth(text, 2) <= width ? 2 : 1;
}

/// Text cut to `width`.
void label(Rgb8& sheet, int x, int y, int width, int scale, const std::string& text) {
  const int letters = std::max(1, (width / scale + 1) / kGlyphAdvance);
  drawText(sheet, x, y, scale, text.substr(0, static_cast<std::size_t>(letters)), kText);
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
  const int scale = width >= 256 ? 2 : 1;
  const int line = kGlyphHeight * scale;
  Rgb8 picture = blank(width, height + kPanelGap + kBarHeight + 4 + line);
  paste(picture, mapColours(errors, width, height), 0, 0);
  // The bar runs over the whole width, 0 to 1
  for (int x = 0; x < width; ++x)
    fillRectangle(
        picture, x, height + kPanelGap, 1, kBarHeight,
        measure::magma(width > 1 ? static_cast<float>(x) / static_cast<float>(width - 1) : 0.0f));
  const int count = width >= 200 ? 5 : 2;
  for (int i = 0; i < count; ++i) {
    const double value = static_cast<double>(i) / (count - 1);
    const std::string text = i == 0 ? "0" : i == count - 1 ? "1" : fixedText(value, 2);
    const int wide = textWidth(text, scale);
    const int x = static_cast<int>(std::lround(value * (width - 1))) - wide / 2;
    drawText(picture, std::clamp(x, 0, std::max(0, width - wide)),
             height + kPanelGap + kBarHeight + 4, scale, text, kText);
  }
  return picture;
}

Rgb8 sideBySide(const FrameErrors& frame) {
  const int width = frame.image.width;
  const int height = frame.image.height;
  const measure::ImageError& e = frame.errors;
  struct Cell {
    std::string title;
    Rgb8 picture;
  };
  const auto difference = [&](int gain) {
    return Rgb8{width, height, differenceRgb8(frame.image, frame.reference, gain)};
  };
  const std::vector<Cell> cells = {
      {frame.name, shown(frame.image)},
      {frame.referenceName, shown(frame.reference)},
      {"difference x50, L1_8bit " + fixedText(e.l1(), 3), difference(50)},
      {"difference, max " + std::to_string(e.max8), difference(1)},
      {"LDR-FLIP " + fixedText(e.flip(), 4), heatMap(frame.maps.flip, width, height)},
      {"HDR-FLIP " + fixedText(e.hdrFlip(), 4), heatMap(frame.maps.hdrFlip, width, height)}};
  const int line = 2 * kGlyphHeight + kPanelGap;
  const int mapHeight = cells.back().picture.height;
  // Small frames stand apart as far as their titles need
  int cellWidth = width;
  for (const Cell& cell : cells) cellWidth = std::max(cellWidth, textWidth(cell.title, 1));
  Rgb8 sheet = blank(3 * cellWidth + 4 * kPanelGap, 3 * line + height + mapHeight + 3 * kPanelGap);
  const std::string title = frame.name + " against " + frame.referenceName + ", frame " +
                            std::to_string(frame.frame) + ", RMSE " + fixedText(e.rmse(), 5) +
                            ", SSIM " + fixedText(e.ssim(), 4);
  const int inner = sheet.width - 2 * kPanelGap;
  label(sheet, kPanelGap, kPanelGap, inner, scaleFor(title, inner), title);
  int scale = 2;
  for (const Cell& cell : cells) scale = std::min(scale, scaleFor(cell.title, cellWidth));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int x = kPanelGap + static_cast<int>(i % 3) * (cellWidth + kPanelGap);
    const int y = kPanelGap + line + static_cast<int>(i / 3) * (line + height + kPanelGap);
    label(sheet, x, y, cellWidth, scale, cells[i].title);
    paste(sheet, cells[i].picture, x, y + line);
  }
  return sheet;
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
  const Rgb8 sheet = sideBySide(frame);
  write(".sheet.png", sheet.width, sheet.height, sheet.rgb);
}

}  // namespace catoptric::report
