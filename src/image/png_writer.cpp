// PNG files in memory. [PNG "Portable Network Graphics Specification, Second Edition", W3C 2003]
#include <libdeflate.h>

#include <array>
#include <cstring>
#include <string>
#include <string_view>

#include "core/error.h"
#include "image/deflate.h"
#include "image/image.h"

namespace catoptric::image {
namespace {

/// Measured at 1024 x 1024: 15 ms and 1.13 MiB; zlib at its level 1 took 36 ms and 1.22 MiB
constexpr int kLevel = 1;
constexpr std::byte kSub{1};  ///< filter type: the difference from the pixel to the left

void append32(std::vector<std::byte>& bytes, std::size_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(std::byte((value >> shift) & 0xFF));
}

/// Length, type, data, and the CRC of type and data. [PNG 5.3]
void appendChunk(std::vector<std::byte>& file, std::string_view type,
                 std::span<const std::byte> data) {
  append32(file, data.size());
  const std::size_t begin = file.size();
  for (const char letter : type) file.push_back(static_cast<std::byte>(letter));
  file.insert(file.end(), data.begin(), data.end());
  append32(file, libdeflate_crc32(0, file.data() + begin, file.size() - begin));
}

std::vector<std::byte> filtered(int width, int height, int channels,
                                std::span<const std::uint8_t> pixels) {
  const auto step = static_cast<std::size_t>(channels);
  const std::size_t row = static_cast<std::size_t>(width) * step;
  std::vector<std::byte> lines;
  lines.resize((row + 1) * static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const std::uint8_t* from = pixels.data() + y * row;
    std::byte* to = lines.data() + y * (row + 1);
    *to++ = kSub;
    std::memcpy(to, from, step);
    for (std::size_t i = step; i < row; ++i)
      to[i] = static_cast<std::byte>(static_cast<std::uint8_t>(from[i] - from[i - step]));
  }
  return lines;
}

}  // namespace

std::vector<std::byte> encodePng(int width, int height, int channels,
                                 std::span<const std::uint8_t> pixels) {
  const std::string size =
      std::to_string(width) + " x " + std::to_string(height) + " x " + std::to_string(channels);
  if (width < 1 || height < 1 || (channels != 1 && channels != 3 && channels != 4))
    throw OutputError("PNG of " + size + ": sizes must be positive, channels 1, 3 or 4");
  if (pixels.size() != static_cast<std::size_t>(width) * height * channels)
    throw OutputError("PNG of " + size + ": " + std::to_string(pixels.size()) +
                      " bytes; this is not width x height x channels");

  const int type = channels == 1 ? 0 : channels == 3 ? 2 : 6;  // grey, RGB, RGBA
  std::vector<std::byte> header;
  append32(header, static_cast<std::size_t>(width));
  append32(header, static_cast<std::size_t>(height));
  for (const int value : {8, type, 0, 0, 0}) header.push_back(static_cast<std::byte>(value));

  Deflater deflater(kLevel);
  const std::vector<std::byte> lines = filtered(width, height, channels, pixels);
  const std::vector<std::byte> data = deflater.compressed(lines, deflater.bound(lines.size()));
  if (data.size() > 0x7FFFFFFF) throw OutputError("PNG of " + size + ": more than 2 GiB");

  std::vector<std::byte> file;
  file.reserve(data.size() + 256);
  for (const char letter : std::string_view("\x89PNG\r\n\x1A\n"))
    file.push_back(static_cast<std::byte>(letter));
  appendChunk(file, "IHDR", header);
  // sRGB with perceptual intent, and for older programs the same as gamma and chromaticities
  std::vector<std::byte> gamma;
  append32(gamma, 45455);
  appendChunk(file, "gAMA", gamma);
  std::vector<std::byte> primaries;  // white point, red, green, blue; x and y by 100,000
  for (const std::size_t value : {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000})
    append32(primaries, value);
  appendChunk(file, "cHRM", primaries);
  appendChunk(file, "sRGB", std::array{std::byte{0}});
  appendChunk(file, "IDAT", data);
  appendChunk(file, "IEND", {});
  return file;
}

}  // namespace catoptric::image
