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

constexpr Colour kEmpty = {44, 46, 50};
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

/// Where everything stands: a title, then a line of text above every row; of several runs the frame
/// numbers stand above the columns.
struct Layout {
  bool several = false;
  std::string title;
  std::vector<int> frames;
  int columns = 0;
  int rows = 0;
  int cellWidth = 0;
  int cellHeight = 0;
  int textsWidth = 0;  ///< which a sheet of few columns makes room for

  int titleHeight() const { return title.empty() ? 0 : kGlyphHeight * kTitleScale + kGap; }
  int cellX(int column) const { return kMargin + column * (cellWidth + kGap); }
  int rowY(int row) const {
    return kMargin + titleHeight() + (several ? kLine : 0) + row * (kLine + cellHeight + kGap);
  }
  int width() const {
    return 2 * kMargin + std::max(columns * cellWidth + (columns - 1) * kGap,
                                  std::min(textsWidth, kMaxTextWidth));
  }
  int height() const { return rowY(rows) - kGap + kMargin; }
};

std::string captionOf(const SheetOptions& options, const std::string& name) {
  const auto caption = options.captions.find(name);
  return caption == options.captions.end() ? "" : caption->second;
}

/// Chooses the frames, of all that any run has, and the cells' size, by the first picture there is.
Layout layOut(std::span<const RunData> runs, const SheetOptions& options) {
  std::set<int> numbers;
  for (const RunData& run : runs) {
    for (const auto& [number, file] : run.frames) numbers.insert(number);
    for (const auto& [number, file] : run.previews) numbers.insert(number);
  }
  if (numbers.empty()) throw UsageError("contact sheet: no run has a frame or a preview");
  Layout layout;
  layout.several = runs.size() > 1;
  layout.frames = spread({numbers.begin(), numbers.end()},
                         static_cast<std::size_t>(
                             std::max(1, layout.several ? options.maxColumns : options.maxFrames)));
  const int count = static_cast<int>(layout.frames.size());
  layout.columns = layout.several ? count : std::min(count, std::max(1, options.maxColumns));
  layout.rows = layout.several ? static_cast<int>(runs.size())
                               : (count + layout.columns - 1) / layout.columns;
  for (std::size_t i = 0; i < runs.size() * layout.frames.size() && layout.cellWidth == 0; ++i) {
    const Rgb8 picture =
        loadFrame(runs[i / layout.frames.size()], layout.frames[i % layout.frames.size()]);
    if (picture.width == 0) continue;
    layout.cellWidth = std::min(std::max(16, options.cellWidth), picture.width);
    layout.cellHeight =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(layout.cellWidth) *
                                                 picture.height / picture.width)));
  }

  layout.title = options.title;
  if (!layout.several) {
    const std::string caption = captionOf(options, runs[0].name);
    layout.title += (layout.title.empty() ? "" : ": ") + runs[0].name;
    if (!caption.empty()) layout.title += "   " + caption;
  }
  layout.textsWidth = textWidth(layout.title, kTextScale);
  if (layout.several)
    for (const RunData& run : runs)
      layout.textsWidth =
          std::max(layout.textsWidth,
                   textWidth(run.name + (options.captions.contains(run.name) ? "   " : "") +
                                 captionOf(options, run.name),
                             kTextScale));
  return layout;
}

/// The frames' numbers above the columns, the runs' names and captions above their rows.
void drawHeaders(Rgb8& sheet, const Layout& layout, std::span<const RunData> runs,
                 const SheetOptions& options) {
  const int inner = sheet.width - 2 * kMargin;
  for (int c = 0; c < layout.columns; ++c)
    drawText(sheet, layout.cellX(c), kMargin + layout.titleHeight(), kTextScale,
             cut("frame " + std::to_string(layout.frames[static_cast<std::size_t>(c)]), kTextScale,
                 layout.cellWidth),
             kFaint);
  for (int r = 0; r < layout.rows; ++r) {
    const std::string& name = runs[static_cast<std::size_t>(r)].name;
    const std::string shown = cut(name, kTextScale, inner);
    drawText(sheet, kMargin, layout.rowY(r), kTextScale, shown, kText);
    const int x = textWidth(shown, kTextScale) + 3 * kGlyphAdvance * kTextScale;
    drawText(sheet, kMargin + x, layout.rowY(r), kTextScale,
             cut(captionOf(options, name), kTextScale, std::max(0, inner - x)), kFaint);
  }
}

/// The pictures, row by row, shrunk into their cells.
std::vector<Cell> loadCells(std::span<const RunData> runs, const Layout& layout) {
  std::vector<Cell> cells;
  for (const RunData& run : runs)
    for (const int frame : layout.frames) cells.push_back({&run, frame, {}});
  parallelFor(cells.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Rgb8 picture = loadFrame(*cells[i].run, cells[i].frame);
      if (picture.width > 0)
        cells[i].picture = fitted(picture, layout.cellWidth, layout.cellHeight);
    }
  });
  return cells;
}

void drawCell(Rgb8& sheet, const Layout& layout, const Cell& cell, std::size_t number) {
  const int column = static_cast<int>(number) % layout.columns;
  const int row = static_cast<int>(number) / layout.columns;
  const int x = layout.cellX(column);
  const int y = layout.rowY(row) + kLine;
  if (!layout.several)
    drawText(sheet, x, layout.rowY(row), kTextScale,
             cut("frame " + std::to_string(cell.frame), kTextScale, layout.cellWidth), kFaint);
  if (cell.picture.width > 0) {
    paste(sheet, cell.picture, x + (layout.cellWidth - cell.picture.width) / 2,
          y + (layout.cellHeight - cell.picture.height) / 2);
    return;
  }
  fillRectangle(sheet, x, y, layout.cellWidth, layout.cellHeight, kEmpty);
  const std::string missing = cut("missing", kTextScale, layout.cellWidth);
  drawText(sheet, x + (layout.cellWidth - textWidth(missing, kTextScale)) / 2,
           y + (layout.cellHeight - kGlyphHeight * kTextScale) / 2, kTextScale, missing, kFaint);
}

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
  const Layout layout = layOut(runs, options);
  Rgb8 sheet{layout.width(), layout.height(), {}};
  sheet.rgb.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 3);
  fillRectangle(sheet, 0, 0, sheet.width, sheet.height, kPaper);
  const int inner = sheet.width - 2 * kMargin;
  // A long title goes smaller before it is cut
  const int titleScale = textWidth(layout.title, kTitleScale) <= inner ? kTitleScale : kTextScale;
  drawText(sheet, kMargin, kMargin, titleScale, cut(layout.title, titleScale, inner), kText);
  if (layout.several) drawHeaders(sheet, layout, runs, options);

  const std::vector<Cell> cells = loadCells(runs, layout);
  for (std::size_t i = 0; i < cells.size(); ++i) drawCell(sheet, layout, cells[i], i);
  return sheet;
}

std::vector<std::byte> contactSheetPng(std::span<const RunData> runs, const SheetOptions& options) {
  const Rgb8 sheet = contactSheet(runs, options);
  return image::encodePng(sheet.width, sheet.height, 3, sheet.rgb);
}

}  // namespace catoptric::report
