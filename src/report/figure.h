// Figures of papers and contact sheets: labelled pictures side by side, as PNG, PDF or SVG. A
// figure is a value, and one function draws it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace catoptric::report {

/// 8-bit display-referred colours; rows start at the top.
struct Rgb8 {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};
using Colour = std::array<std::uint8_t, 3>;

struct Panel {
  std::string label;  ///< above the picture
  Rgb8 picture;       ///< empty: the panel says that the picture is missing
};

struct PanelRow {
  std::string heading;  ///< a line of text above the row
  std::vector<Panel> panels;
};

struct Figure {
  std::string title;
  std::vector<PanelRow> rows;
  bool dark = false;  ///< light text on a dark background
};

/// Draws a figure in the format that the extension of `file` names: .png, .pdf or .svg. Equal
/// figures give equal bytes. Labels in PDF and SVG files are text. Throws UsageError for another
/// extension, OutputError if the font is missing.
std::vector<std::byte> drawFigure(const Figure& figure, const std::filesystem::path& file);

/// A part of a picture; a width of 0 means the whole picture.
struct Crop {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// The source of a panel's picture.
struct Shown {
  std::filesystem::path frame;    ///< an EXR file
  std::string layer;              ///< empty: the frame's colours
  std::string mask;               ///< draws red where the layer mask.NAME is above 0
  std::filesystem::path against;  ///< the frame to subtract, for a difference
  int difference = 0;  ///< if above 0: show |frame - against| in display steps times this factor
  Crop crop;
  int zoom = 1;   ///< each pixel becomes a square of this many pixels
  int width = 0;  ///< wider pictures are reduced to this width; 0: no limit
};

/// Makes the picture of a panel. Throws UsageError for layers and parts that the frame lacks.
Rgb8 pictureOf(const Shown& shown);

/// L1_8bit of a part of two frames, over all or only reflective pixels. Throws UsageError if the
/// frames' sizes differ, or if they lack the part.
double l1Of(const std::filesystem::path& frame, const std::filesystem::path& against,
            bool reflective, const Crop& crop = {});

/// Reduces a picture; each pixel is the mean of the area below it, in linear light.
Rgb8 shrink(const Rgb8& picture, int width, int height);

}  // namespace catoptric::report
