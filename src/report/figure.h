// Figures of papers and contact sheets: pictures side by side with labels, as PNG, PDF or SVG. A
// figure is a value, and one function draws it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace catoptric::report {

/// 8-bit display-referred colours, rows from the top.
struct Rgb8 {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};
using Colour = std::array<std::uint8_t, 3>;

struct Panel {
  std::string label;  ///< above the picture
  Rgb8 picture;       ///< empty: the panel says that it is missing
};

struct PanelRow {
  std::string heading;  ///< a line above the row
  std::vector<Panel> panels;
};

struct Figure {
  std::string title;
  std::vector<PanelRow> rows;
  bool dark = false;  ///< light text on dark paper
};

/// Draws a figure; `file` says by its end what is wanted: .png, .pdf or .svg. The same figure gives
/// the same bytes. Labels of PDF and SVG files are text. Throws UsageError for another end,
/// OutputError when the font is not there.
std::vector<std::byte> drawFigure(const Figure& figure, const std::filesystem::path& file);

/// A part of a picture; a width of 0: all of it.
struct Crop {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// What a panel shows of a frame.
struct Shown {
  std::filesystem::path frame;    ///< an EXR file
  std::string layer;              ///< empty: its colours
  std::string mask;               ///< where the layer mask.NAME is above 0, red is shown
  std::filesystem::path against;  ///< of a difference
  int difference = 0;             ///< show |frame - against| in display steps times this; 0: no
  Crop crop;
  int zoom = 1;   ///< pixels become squares of so many pixels
  int width = 0;  ///< wider pictures are made smaller; 0: they are not
};

/// The picture of a panel. Throws UsageError for layers and parts that the frame lacks.
Rgb8 pictureOf(const Shown& shown);

/// L1_8bit of two frames, or over their reflective pixels. Throws UsageError when sizes differ.
double l1Of(const std::filesystem::path& frame, const std::filesystem::path& against,
            bool reflective);

/// Makes a picture smaller by the mean of the area under each pixel, in linear light.
Rgb8 shrink(const Rgb8& picture, int width, int height);

}  // namespace catoptric::report
