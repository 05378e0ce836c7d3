#include "image/hdr.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "core/error.h"

namespace catoptric::image {
namespace {

/// Reads lines and bytes of one file; every error names it.
class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& message) const {
    throw SceneError(name_ + ": bad HDR image: " + message);
  }
  std::uint8_t byte() {
    if (position_ >= bytes_.size()) fail("the file is truncated");
    return static_cast<std::uint8_t>(bytes_[position_++]);
  }
  std::string line() {
    constexpr std::size_t kMaxLine = 4096;
    std::string text;
    for (char c = static_cast<char>(byte()); c != '\n'; c = static_cast<char>(byte())) {
      if (text.size() == kMaxLine) fail("a header line has more than 4096 characters");
      if (c != '\r') text += c;
    }
    return text;
  }
  bool nextIsNewRow() const {  // a row in the new run-length form begins with 2 2 and its length
    return position_ + 4 <= bytes_.size() && bytes_[position_] == std::byte{2} &&
           bytes_[position_ + 1] == std::byte{2} &&
           (bytes_[position_ + 2] & std::byte{0x80}) == std::byte{0};
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  const std::string& name_;
};

bool startsWith(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

/// Header lines up to the empty one; the product of all EXPOSURE values.
double readHeader(Reader& reader) {
  double exposure = 1.0;
  for (std::string line = reader.line(); !line.empty(); line = reader.line()) {
    if (startsWith(line, "FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
      reader.fail("\"" + line + "\" is not supported; only FORMAT=32-bit_rle_rgbe is");
    if (startsWith(line, "EXPOSURE=")) {
      std::string_view text(line);
      text.remove_prefix(9);
      while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
      double factor = 0.0;
      std::from_chars(text.data(), text.data() + text.size(), factor);
      if (!(factor > 0.0 && std::isfinite(factor))) reader.fail("\"" + line + "\"");
      exposure *= factor;
    }
  }
  if (!(exposure > 1e-20 && exposure < 1e20))
    reader.fail("the product of the EXPOSURE lines is not from 1e-20 to 1e20");
  return exposure;
}

/// "-Y height +X width": the only orientation that environment maps come in.
void readResolution(Reader& reader, Image& image) {
  const std::string line = reader.line();
  int width = 0;
  int height = 0;
  const char* const end = line.data() + line.size();
  bool good = startsWith(line, "-Y ");
  if (good) {
    const auto [after, error] = std::from_chars(line.data() + 3, end, height);
    good = error == std::errc() && startsWith(std::string_view(after, end - after), " +X ");
    if (good) {
      const auto [last, error2] = std::from_chars(after + 4, end, width);
      good = error2 == std::errc() && last == end;
    }
  }
  if (!good || width < 1 || height < 1)
    reader.fail("resolution \"" + line + "\" is not supported; only \"-Y height +X width\" is");
  image.width = width;
  image.height = height;
}

using Rgbe = std::uint8_t[4];

/// The new form: four components one after the other, each in runs.
void readNewRow(Reader& reader, std::vector<std::uint8_t>& row, std::size_t width) {
  reader.byte();
  reader.byte();
  const std::size_t high = reader.byte();
  if ((high << 8 | reader.byte()) != width) reader.fail("a row does not have the image's width");
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t x = 0; x < width;) {
      std::size_t count = reader.byte();
      const bool run = count > 128;
      if (run) count -= 128;
      if (count == 0 || count > width - x) reader.fail("a run extends beyond the end of its row");
      const std::uint8_t value = run ? reader.byte() : std::uint8_t{0};
      for (std::size_t i = 0; i < count; ++i, ++x) row[4 * x + c] = run ? value : reader.byte();
    }
  }
}

/// Flat pixels, among which 1 1 1 n repeats the last one (n << 8 for a second such one in a row).
void readOldRow(Reader& reader, std::vector<std::uint8_t>& row, std::size_t width) {
  unsigned shift = 0;
  for (std::size_t x = 0; x < width;) {
    std::uint8_t* pixel = &row[4 * x];
    for (std::size_t c = 0; c < 4; ++c) pixel[c] = reader.byte();
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      ++x;
      shift = 0;
      continue;
    }
    const std::size_t count = std::size_t{pixel[3]} << shift;
    if (x == 0 || shift > 16 || count > width - x)
      reader.fail("a run extends beyond the end of its row");
    for (std::size_t i = 0; i < count; ++i, ++x) std::copy_n(&row[4 * (x - 1)], 4, &row[4 * x]);
    shift += 8;
  }
}

}  // namespace

bool isHdr(std::span<const std::byte> bytes) {
  return bytes.size() >= 2 && bytes[0] == std::byte{'#'} && bytes[1] == std::byte{'?'};
}

Image decodeHdr(std::span<const std::byte> bytes, const std::string& name, std::size_t maxValues) {
  Reader reader(bytes, name);
  reader.line();  // "#?RADIANCE", or another program's name
  const double exposure = readHeader(reader);
  Image image;
  readResolution(reader, image);
  if (image.pixelCount() > maxValues / 3)
    reader.fail(std::to_string(image.width) + " x " + std::to_string(image.height) +
                " pixels, more than the " + std::to_string(maxValues / 3) + " allowed");

  image.channels = {"R", "G", "B"};
  image.data.resize(image.pixelCount() * 3);
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::uint8_t> row(width * 4);
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y) {
    if (width >= 8 && width < 0x8000 && reader.nextIsNewRow())
      readNewRow(reader, row, width);
    else
      readOldRow(reader, row, width);
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t* p = &row[4 * x];
      const double scale = p[3] == 0 ? 0.0 : std::ldexp(1.0, int{p[3]} - 136) / exposure;
      for (std::size_t c = 0; c < 3; ++c)
        image.data[3 * (y * width + x) + c] = static_cast<float>(p[c] * scale);
    }
  }
  return image;
}

}  // namespace catoptric::image
