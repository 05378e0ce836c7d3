// Text in pictures: a font of our own, 5 x 7 dots with descenders, printable ASCII.
#pragma once

#include <array>
#include <cstdint>
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

inline constexpr Colour kPaper = {24, 25, 28};
inline constexpr Colour kText = {236, 236, 232};

inline constexpr int kGlyphAdvance = 6;  ///< dots from one letter to the next
inline constexpr int kGlyphHeight = 9;   ///< dots, descenders included

/// Pixels that `text` takes, without the gap after its last letter.
int textWidth(const std::string& text, int scale);
/// Draws with the upper left corner at (x, y), `scale` pixels a dot; cut at the borders. Letters
/// outside printable ASCII show as "?".
void drawText(Rgb8& picture, int x, int y, int scale, const std::string& text, Colour colour);
void fillRectangle(Rgb8& picture, int x, int y, int width, int height, Colour colour);
/// Copies the picture onto the sheet, its upper left corner at (left, top).
void paste(Rgb8& sheet, const Rgb8& picture, int left, int top);

}  // namespace catoptric::report
