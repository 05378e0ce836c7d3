#include "report/figure.h"

#include <cairo-ft.h>
#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "core/error.h"
#include "core/text.h"
#include "image/image.h"
#include "report/html.h"

namespace catoptric::report {
namespace {

/// DejaVu Sans of Debian's package fonts-dejavu-core. By its file, since a font's name may stand
/// for another font on another machine.
constexpr const char* kFontFile = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr double kTextSize = 13.0;
constexpr double kTitleSize = 18.0;
constexpr double kLeastSize = 9.0;  ///< of a text that would be too wide
constexpr int kMargin = 12;         ///< of contact sheets; a paper has its own
constexpr int kGap = 6;
constexpr int kTextLine = 20;
constexpr int kTitleLine = 28;
constexpr int kMostTextWidth = 1200;  ///< a title or heading widens a figure up to here
constexpr int kLeastCell = 48;

struct Free {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_scaled_font_t* font) const { cairo_scaled_font_destroy(font); }
};
using Surface = std::unique_ptr<cairo_surface_t, Free>;

void requireDrawn(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw OutputError(std::string("figure: Cairo: ") + cairo_status_to_string(status));
}

cairo_font_face_t* fontFace() {
  static cairo_font_face_t* const face = [] {
    FT_Library library = nullptr;
    FT_Face file = nullptr;
    if (FT_Init_FreeType(&library) != 0 || FT_New_Face(library, kFontFile, 0, &file) != 0)
      throw OutputError(std::string(kFontFile) +
                        ": this font cannot be read; install Debian's package fonts-dejavu-core");
    return cairo_ft_font_face_create_for_ft_face(file, FT_LOAD_NO_HINTING);
  }();
  return face;
}

/// The font in a size, drawn alike whatever the machine's own settings of fonts are.
std::unique_ptr<cairo_scaled_font_t, Free> font(double size) {
  cairo_matrix_t scale;
  cairo_matrix_t unchanged;
  cairo_matrix_init_scale(&scale, size, size);
  cairo_matrix_init_identity(&unchanged);
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  std::unique_ptr<cairo_scaled_font_t, Free> made(
      cairo_scaled_font_create(fontFace(), &scale, &unchanged, options));
  cairo_font_options_destroy(options);
  requireDrawn(cairo_scaled_font_status(made.get()));
  return made;
}

double textWidth(const std::string& text, double size) {
  cairo_text_extents_t extents;
  cairo_scaled_font_text_extents(font(size).get(), text.c_str(), &extents);
  return extents.x_advance;
}

struct PlacedText {
  double x = 0.0;
  double baseline = 0.0;
  double size = 0.0;
  std::string text;
  bool faint = false;
};
struct PlacedPicture {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  const Rgb8* picture = nullptr;  ///< null: missing
};

/// A figure with a place for everything.
struct Drawing {
  int width = 0;
  int height = 0;
  std::vector<PlacedText> texts;
  std::vector<PlacedPicture> pictures;
  Colour paper = {255, 255, 255};
  Colour text = {28, 28, 28};
  Colour faint = {70, 70, 70};
  Colour empty = {221, 221, 221};

  /// Text within a width: smaller, and at last cut, where it is wider.
  void addText(int x, int top, int room, double size, const std::string& whole, bool isFaint) {
    std::string shown = printable(whole);
    if (shown.empty()) return;
    const double wide = textWidth(shown, size);
    const double fitting = wide <= room ? size : std::max(kLeastSize, size * room / wide);
    if (textWidth(shown, fitting) > room + 0.5) {
      while (!shown.empty() && textWidth(shown + "…", fitting) > room) {
        while (shown.size() > 1 && (shown.back() & 0xC0) == 0x80) shown.pop_back();
        shown.pop_back();
      }
      shown += "…";
    }
    texts.push_back({static_cast<double>(x), top + size, fitting, shown, isFaint});
  }
};

Drawing layOut(const Figure& figure) {
  Drawing drawing;
  if (figure.dark) {
    drawing.paper = {24, 25, 28};
    drawing.text = {236, 236, 232};
    drawing.faint = {160, 163, 168};
    drawing.empty = {44, 46, 50};
  }
  const int margin = figure.dark ? kMargin : 0;
  int cell = kLeastCell;
  std::size_t columns = 1;
  double texts = textWidth(printable(figure.title), kTitleSize);
  for (const PanelRow& row : figure.rows) {
    columns = std::max(columns, row.panels.size());
    texts = std::max(texts, textWidth(printable(row.heading), kTextSize));
    for (const Panel& panel : row.panels) cell = std::max(cell, panel.picture.width);
  }
  const int inner = std::max(static_cast<int>(columns) * (cell + kGap) - kGap,
                             static_cast<int>(std::min<double>(kMostTextWidth, texts + 1.0)));
  drawing.width = inner + 2 * margin;
  int y = margin;
  if (!figure.title.empty()) {
    drawing.addText(margin, y, inner, kTitleSize, figure.title, false);
    y += kTitleLine;
  }
  for (const PanelRow& row : figure.rows) {
    int high = 0;
    bool labels = false;
    for (const Panel& panel : row.panels) {
      high = std::max(high, panel.picture.height);
      labels = labels || !panel.label.empty();
    }
    if (high == 0) high = cell;
    if (!row.heading.empty()) {
      drawing.addText(margin, y, inner, kTextSize, row.heading, false);
      y += kTextLine;
    }
    const int top = y + (labels ? kTextLine : 0);
    int x = margin;
    for (const Panel& panel : row.panels) {
      drawing.addText(x, y, cell, kTextSize, panel.label, true);
      const Rgb8& picture = panel.picture;
      if (picture.width > 0) {
        drawing.pictures.push_back({x + (cell - picture.width) / 2,
                                    top + (high - picture.height) / 2, picture.width,
                                    picture.height, &picture});
      } else {
        drawing.pictures.push_back({x, top, cell, high, nullptr});
        drawing.addText(x + kGap, top + high / 2, cell, kTextSize, "missing", true);
      }
      x += cell + kGap;
    }
    y = top + high + kGap;
  }
  drawing.height = y - kGap + margin;
  return drawing;
}

/// Of a picture, or of an empty one to draw on.
Surface surfaceOf(int width, int height, const Rgb8* picture) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  requireDrawn(cairo_surface_status(surface.get()));
  if (picture == nullptr) return surface;
  cairo_surface_flush(surface.get());
  unsigned char* row = cairo_image_surface_get_data(surface.get());
  const std::uint8_t* from = picture->rgb.data();
  for (int y = 0; y < height; ++y, row += cairo_image_surface_get_stride(surface.get()))
    for (int x = 0; x < width; ++x, from += 3)
      reinterpret_cast<std::uint32_t*>(row)[x] =
          static_cast<std::uint32_t>(from[0] << 16 | from[1] << 8 | from[2]);
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

void paint(cairo_surface_t* surface, const Drawing& drawing) {
  const std::unique_ptr<cairo_t, Free> owner(cairo_create(surface));
  cairo_t* context = owner.get();
  const auto use = [&](const Colour& c) {
    cairo_set_source_rgb(context, c[0] / 255.0, c[1] / 255.0, c[2] / 255.0);
  };
  use(drawing.paper);
  cairo_paint(context);
  for (const PlacedPicture& placed : drawing.pictures) {
    if (placed.picture != nullptr) {
      const Surface picture = surfaceOf(placed.width, placed.height, placed.picture);
      cairo_set_source_surface(context, picture.get(), placed.x, placed.y);
      cairo_pattern_set_filter(cairo_get_source(context), CAIRO_FILTER_NEAREST);
    } else {
      use(drawing.empty);
    }
    cairo_rectangle(context, placed.x, placed.y, placed.width, placed.height);
    cairo_fill(context);
  }
  for (const PlacedText& text : drawing.texts) {
    cairo_set_scaled_font(context, font(text.size).get());
    use(text.faint ? drawing.faint : drawing.text);
    cairo_move_to(context, text.x, text.baseline);
    cairo_show_text(context, text.text.c_str());
  }
  requireDrawn(cairo_status(context));
}

std::vector<std::byte> png(const Drawing& drawing) {
  const Surface surface = surfaceOf(drawing.width, drawing.height, nullptr);
  paint(surface.get(), drawing);
  cairo_surface_flush(surface.get());
  std::vector<std::uint8_t> rgb;
  rgb.reserve(static_cast<std::size_t>(drawing.width) * drawing.height * 3);
  const unsigned char* row = cairo_image_surface_get_data(surface.get());
  for (int y = 0; y < drawing.height; ++y, row += cairo_image_surface_get_stride(surface.get()))
    for (int x = 0; x < drawing.width; ++x) {
      const std::uint32_t pixel = reinterpret_cast<const std::uint32_t*>(row)[x];
      for (const int shift : {16, 8, 0})
        rgb.push_back(static_cast<std::uint8_t>(pixel >> shift & 255u));
    }
  return image::encodePng(drawing.width, drawing.height, 3, rgb);
}

std::vector<std::byte> pdf(const Drawing& drawing) {
  std::vector<std::byte> bytes;
  const auto add = [](void* to, const unsigned char* data, unsigned count) {
    const auto* first = reinterpret_cast<const std::byte*>(data);
    static_cast<std::vector<std::byte>*>(to)->insert(
        static_cast<std::vector<std::byte>*>(to)->end(), first, first + count);
    return CAIRO_STATUS_SUCCESS;
  };
  const Surface surface(
      cairo_pdf_surface_create_for_stream(add, &bytes, drawing.width, drawing.height));
  // The same bytes whenever it is drawn
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                 "2000-01-01T00:00:00");
  paint(surface.get(), drawing);
  cairo_surface_finish(surface.get());
  requireDrawn(cairo_surface_status(surface.get()));
  return bytes;
}

/// Cairo's own SVG files have outlines of letters in place of text.
std::vector<std::byte> svg(const Drawing& drawing) {
  const auto hex = [](const Colour& c) {
    return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
  };
  const int width = drawing.width;
  const int height = drawing.height;
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {} {}\" "
      "font-family=\"DejaVu Sans,sans-serif\">\n<rect width=\"{}\" height=\"{}\" fill=\"{}\"/>\n",
      width, height, width, height, width, height, hex(drawing.paper));
  for (const PlacedPicture& placed : drawing.pictures) {
    const std::string place = fmt::format("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"", placed.x,
                                          placed.y, placed.width, placed.height);
    text +=
        placed.picture == nullptr
            ? fmt::format("<rect {} fill=\"{}\"/>\n", place, hex(drawing.empty))
            : fmt::format(
                  "<image {} image-rendering=\"pixelated\" "
                  "href=\"data:image/png;base64,{}\"/>\n",
                  place,
                  base64(image::encodePng(placed.width, placed.height, 3, placed.picture->rgb)));
  }
  for (const PlacedText& placed : drawing.texts)
    text += fmt::format("<text x=\"{:g}\" y=\"{:g}\" font-size=\"{:.4g}\" fill=\"{}\">{}</text>\n",
                        placed.x, placed.baseline, placed.size,
                        hex(placed.faint ? drawing.faint : drawing.text), xmlText(placed.text));
  text += "</svg>\n";
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

}  // namespace

std::vector<std::byte> drawFigure(const Figure& figure, const std::filesystem::path& file) {
  const std::string end = file.extension().string();
  if (end != ".png" && end != ".pdf" && end != ".svg")
    throw UsageError(file.string() + ": a figure's file must end in .png, .pdf or .svg");
  const Drawing drawing = layOut(figure);
  return end == ".png" ? png(drawing) : end == ".pdf" ? pdf(drawing) : svg(drawing);
}

}  // namespace catoptric::report
