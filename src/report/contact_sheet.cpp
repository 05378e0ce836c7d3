#include "report/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "image/image.h"

namespace catoptric::report {
namespace {

constexpr Colour kPaper = {24, 25, 28};
constexpr Colour kEmpty = {44, 46, 50};
constexpr Colour kText = {236, 236, 232};
constexpr Colour kFaint = {160, 163, 168};
constexpr int kMargin = 16;
constexpr int kGap = 8;
constexpr int kTitleScale = 3;
constexpr int kTextScale = 2;
constexpr int kMaxTextWidth = 1200;  ///< texts widen a sheet up to here, pixels
constexpr int kLine = kGlyphHeight * kTextScale + 6;
/// What a preview may hold: 16384 x 16384.
constexpr std::size_t kMaxPixels = std::size_t{1} << 28;

/// The frame as it is shown; empty when the run lacks it.
Rgb8 loadFrame(const RunData& run, int number) {
  Rgb8 picture;
  if (const auto preview = run.previews.find(number); preview != run.previews.end()) {
    const image::Image8 png =
        image::decodeImage8(readFile(preview->second), preview->second.string(), kMaxPixels);
    picture.width = png.width;
    picture.height = png.height;
    picture.rgb.reserve(png.rgba.size() / 4 * 3);
    for (std::size_t i = 0; i < png.rgba.size(); i += 4)
      picture.rgb.insert(picture.rgb.end(), {png.rgba[i], png.rgba[i + 1], png.rgba[i + 2]});
  } else if (const auto frame = run.frames.find(number); frame != run.frames.end()) {
    const image::Image exr = image::readImage(frame->second);
    picture.width = exr.width;
    picture.height = exr.height;
    picture.rgb = image::displayRgb8(exr);
  }
  return picture;
}

/// Shrunk into the cell, its shape kept; never enlarged.
Rgb8 fitted(const Rgb8& picture, int cellWidth, int cellHeight) {
  const double scale = std::min({1.0, static_cast<double>(cellWidth) / picture.width,
                                 static_cast<double>(cellHeight) / picture.height});
  const auto scaled = [&](int size) {
    return std::max(1, static_cast<int>(std::lround(size * scale)));
  };
  return scale == 1.0 ? picture : shrink(picture, scaled(picture.width), scaled(picture.height));
}

void paste(Rgb8& sheet, const Rgb8& picture, int x, int y) {
  for (int row = 0; row < picture.height; ++row)
    std::copy_n(picture.rgb.begin() + static_cast<std::ptrdiff_t>(row) * picture.width * 3,
                picture.width * 3,
                sheet.rgb.begin() + (static_cast<std::ptrdiff_t>(y + row) * sheet.width + x) * 3);
}

/// `text` cut to a width, with two dots at its end.
std::string cut(const std::string& text, int scale, int width) {
  if (textWidth(text, scale) <= width) return text;
  const int letters = std::max(2, width / (kGlyphAdvance * scale));
  return text.substr(0, static_cast<std::size_t>(letters - 2)) + "..";
}

struct Cell {
  const RunData* run = nullptr;
  int frame = 0;
  Rgb8 picture;
};

}  // namespace

std::vector<int> spread(const std::vector<int>& all, std::size_t count) {
  if (all.size() <= count || count == 0) return all;
  if (count == 1) return {all.front()};
  std::vector<int> chosen;
  for (std::size_t i = 0; i < count; ++i)
    chosen.push_back(all[(i * (all.size() - 1) + (count - 1) / 2) / (count - 1)]);
  return chosen;
}

Rgb8 shrink(const Rgb8& picture, int width, int height) {
  // Each output pixel covers the range [i, i + 1) * size / newSize of the input
  struct Weight {
    int from = 0;
    std::vector<float> weights;
  };
  const auto coverage = [](int size, int newSize) {
    std::vector<Weight> all;
    for (int i = 0; i < newSize; ++i) {
      const double begin = static_cast<double>(i) * size / newSize;
      const double end = static_cast<double>(i + 1) * size / newSize;
      Weight w;
      w.from = static_cast<int>(begin);
      for (int p = w.from; p < size && p < end; ++p)
        w.weights.push_back(static_cast<float>(
            (std::min<double>(end, p + 1) - std::max<double>(begin, p)) / (end - begin)));
      all.push_back(std::move(w));
    }
    return all;
  };
  const auto columns = coverage(picture.width, width);
  const auto rows = coverage(picture.height, height);
  const auto& linear = linearOfSrgb8();

  // Along rows, in linear light
  std::vector<float> narrow(static_cast<std::size_t>(width) * picture.height * 3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < width; ++x) {
      const Weight& w = columns[static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < 3; ++c) {
        float sum = 0.0f;
        for (std::size_t i = 0; i < w.weights.size(); ++i)
          sum +=
              w.weights[i] *
              linear[picture
                         .rgb[(static_cast<std::size_t>(y) * picture.width + w.from + i) * 3 + c]];
        narrow[(static_cast<std::size_t>(y) * width + x) * 3 + c] = sum;
      }
    }
  // Along columns, and back to display steps
  Rgb8 result{width, height, {}};
  result.rgb.resize(static_cast<std::size_t>(width) * height * 3);
  const std::size_t stride = static_cast<std::size_t>(width) * 3;
  for (int y = 0; y < height; ++y) {
    const Weight& w = rows[static_cast<std::size_t>(y)];
    for (std::size_t i = 0; i < stride; ++i) {
      float sum = 0.0f;
      for (std::size_t k = 0; k < w.weights.size(); ++k)
        sum += w.weights[k] * narrow[(static_cast<std::size_t>(w.from) + k) * stride + i];
      result.rgb[static_cast<std::size_t>(y) * stride + i] =
          static_cast<std::uint8_t>(std::lround(image::display8(sum)));
    }
  }
  return result;
}

Rgb8 contactSheet(std::span<const RunData> runs, const SheetOptions& options) {
  // Choose the frames: of all that any run has
  std::set<int> numbers;
  for (const RunData& run : runs) {
    for (const auto& [number, file] : run.frames) numbers.insert(number);
    for (const auto& [number, file] : run.previews) numbers.insert(number);
  }
  if (numbers.empty()) throw UsageError("contact sheet: no run has a frame or a preview");
  const bool several = runs.size() > 1;
  const std::vector<int> frames = spread(
      {numbers.begin(), numbers.end()},
      static_cast<std::size_t>(std::max(1, several ? options.maxColumns : options.maxFrames)));
  const int count = static_cast<int>(frames.size());
  const int columns = several ? count : std::min(count, std::max(1, options.maxColumns));
  const int rows = several ? static_cast<int>(runs.size()) : (count + columns - 1) / columns;

  // Load and shrink; the first picture found gives the cells' shape
  std::vector<Cell> cells;
  for (const RunData& run : runs)
    for (const int frame : frames) cells.push_back({&run, frame, {}});
  int cellWidth = 0;
  int cellHeight = 0;
  for (const Cell& cell : cells) {
    const Rgb8 picture = loadFrame(*cell.run, cell.frame);
    if (picture.width == 0) continue;
    cellWidth = std::min(std::max(16, options.cellWidth), picture.width);
    cellHeight = std::max(1, static_cast<int>(std::lround(static_cast<double>(cellWidth) *
                                                          picture.height / picture.width)));
    break;
  }
  parallelFor(cells.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Rgb8 picture = loadFrame(*cells[i].run, cells[i].frame);
      if (picture.width > 0) cells[i].picture = fitted(picture, cellWidth, cellHeight);
    }
  });

  // Lay out: title, then a line of text above every row; frame numbers above the columns
  std::string title = options.title;
  if (!several) {
    title += (title.empty() ? "" : ": ") + runs[0].name;
    if (const auto caption = options.captions.find(runs[0].name);
        caption != options.captions.end() && !caption->second.empty())
      title += "   " + caption->second;
  }
  const int titleHeight = title.empty() ? 0 : kGlyphHeight * kTitleScale + kGap;
  const int columnHeader = several ? kLine : 0;
  Rgb8 sheet;
  // A single small column makes room for its texts
  int textNeeds = textWidth(title, kTextScale);
  if (several)
    for (const RunData& run : runs) {
      const auto caption = options.captions.find(run.name);
      const std::string text = caption == options.captions.end() ? "" : "   " + caption->second;
      textNeeds = std::max(textNeeds, textWidth(run.name + text, kTextScale));
    }
  sheet.width = 2 * kMargin + std::max(columns * cellWidth + (columns - 1) * kGap,
                                       std::min(textNeeds, kMaxTextWidth));
  sheet.height =
      2 * kMargin + titleHeight + columnHeader + rows * (kLine + cellHeight) + (rows - 1) * kGap;
  sheet.rgb.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 3);
  fillRectangle(sheet, 0, 0, sheet.width, sheet.height, kPaper);
  const int inner = sheet.width - 2 * kMargin;
  // A long title goes smaller before it is cut
  const int titleScale = textWidth(title, kTitleScale) <= inner ? kTitleScale : kTextScale;
  drawText(sheet, kMargin, kMargin, titleScale, cut(title, titleScale, inner), kText);

  const auto cellX = [&](int column) { return kMargin + column * (cellWidth + kGap); };
  const int top = kMargin + titleHeight + columnHeader;
  const auto rowY = [&](int row) { return top + row * (kLine + cellHeight + kGap); };
  if (several) {
    for (int c = 0; c < columns; ++c)
      drawText(sheet, cellX(c), kMargin + titleHeight, kTextScale,
               cut("frame " + std::to_string(frames[static_cast<std::size_t>(c)]), kTextScale,
                   cellWidth),
               kFaint);
    for (int r = 0; r < rows; ++r) {
      const std::string& name = runs[static_cast<std::size_t>(r)].name;
      const std::string shown = cut(name, kTextScale, inner);
      drawText(sheet, kMargin, rowY(r), kTextScale, shown, kText);
      const auto caption = options.captions.find(name);
      if (caption == options.captions.end()) continue;
      const int x = textWidth(shown, kTextScale) + 3 * kGlyphAdvance * kTextScale;
      drawText(sheet, kMargin + x, rowY(r), kTextScale,
               cut(caption->second, kTextScale, std::max(0, inner - x)), kFaint);
    }
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int column = static_cast<int>(i) % columns;
    const int row = static_cast<int>(i) / columns;
    const int y = rowY(row) + kLine;
    if (!several)
      drawText(sheet, cellX(column), rowY(row), kTextScale,
               cut("frame " + std::to_string(cells[i].frame), kTextScale, cellWidth), kFaint);
    const Rgb8& picture = cells[i].picture;
    if (picture.width > 0) {
      paste(sheet, picture, cellX(column) + (cellWidth - picture.width) / 2,
            y + (cellHeight - picture.height) / 2);
      continue;
    }
    fillRectangle(sheet, cellX(column), y, cellWidth, cellHeight, kEmpty);
    const std::string missing = cut("missing", kTextScale, cellWidth);
    drawText(sheet, cellX(column) + (cellWidth - textWidth(missing, kTextScale)) / 2,
             y + (cellHeight - kGlyphHeight * kTextScale) / 2, kTextScale, missing, kFaint);
  }
  return sheet;
}

std::vector<std::byte> contactSheetPng(std::span<const RunData> runs, const SheetOptions& options) {
  const Rgb8 sheet = contactSheet(runs, options);
  return image::encodePng(sheet.width, sheet.height, 3, sheet.rgb);
}

}  // namespace catoptric::report
