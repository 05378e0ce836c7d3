#include "image/exr_zip.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "core/parallel.h"
#include "image/deflate.h"

namespace catoptric::image {
namespace {

constexpr std::size_t kBlockRows = 16;

/// Appends a number in EXR's order of bytes, which is that of x86.
template <class T>
void append(std::vector<std::byte>& bytes, T value) {
  bytes.resize(bytes.size() + sizeof value);
  std::memcpy(bytes.data() + bytes.size() - sizeof value, &value, sizeof value);
}

template <class T>
std::byte* packChannel(const std::byte* from, std::size_t stride, std::size_t width,
                       std::byte* to) {
  for (std::size_t x = 0; x < width; ++x, from += stride, to += sizeof(T)) {
    T value;
    std::memcpy(&value, from, sizeof value);
    std::memcpy(to, &value, sizeof value);
  }
  return to;
}

/// Rows one after the other, in each the channels one after the other.
std::vector<std::byte> packed(std::span<const ExrChannel> channels, std::size_t width,
                              std::size_t first, std::size_t rows) {
  std::size_t rowBytes = 0;
  for (const ExrChannel& channel : channels) rowBytes += width * channel.size;
  std::vector<std::byte> block(rows * rowBytes);
  std::byte* to = block.data();
  for (std::size_t y = first; y < first + rows; ++y)
    for (const ExrChannel& channel : channels) {
      const std::byte* from = channel.values + y * width * channel.stride;
      to = channel.size == 2 ? packChannel<std::uint16_t>(from, channel.stride, width, to)
                             : packChannel<std::uint32_t>(from, channel.stride, width, to);
    }
  return block;
}

/// The bytes at even places, then those at odd ones, each as its difference from the byte before
/// it plus 128. [OpenEXR "ZIP compression"]
std::vector<std::byte> predicted(std::span<const std::byte> block) {
  const std::size_t half = block.size() / 2;  // values have 2 or 4 bytes
  std::vector<std::uint8_t> apart(block.size());
  for (std::size_t i = 0; i < half; ++i) {
    apart[i] = static_cast<std::uint8_t>(block[2 * i]);
    apart[half + i] = static_cast<std::uint8_t>(block[2 * i + 1]);
  }
  std::vector<std::byte> differences(block.size());
  differences[0] = static_cast<std::byte>(apart[0]);
  for (std::size_t i = 1; i < apart.size(); ++i)
    differences[i] =
        static_cast<std::byte>(static_cast<std::uint8_t>(apart[i] - apart[i - 1] + 128));
  return differences;
}

}  // namespace

void appendZipBlocks(std::vector<std::byte>& file, int width, int height,
                     std::vector<ExrChannel> channels, int level) {
  std::sort(channels.begin(), channels.end(),
            [](const ExrChannel& a, const ExrChannel& b) { return a.name < b.name; });
  const auto allRows = static_cast<std::size_t>(height);
  std::vector<std::vector<std::byte>> blocks((allRows + kBlockRows - 1) / kBlockRows);
  parallelFor(blocks.size(), 4, [&](std::size_t begin, std::size_t end) {
    Deflater deflater(level);
    for (std::size_t b = begin; b < end; ++b) {
      const std::size_t first = b * kBlockRows;
      std::vector<std::byte> block = packed(channels, static_cast<std::size_t>(width), first,
                                            std::min(kBlockRows, allRows - first));
      blocks[b] = deflater.compressed(predicted(block), block.size() - 1);
      if (blocks[b].empty()) blocks[b] = std::move(block);  // what would not shrink is stored
    }
  });
  const std::size_t table = file.size() - blocks.size() * sizeof(std::uint64_t);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::uint64_t offset = file.size();
    std::memcpy(file.data() + table + b * sizeof offset, &offset, sizeof offset);
    append(file, static_cast<std::int32_t>(b * kBlockRows));
    append(file, static_cast<std::int32_t>(blocks[b].size()));
    file.insert(file.end(), blocks[b].begin(), blocks[b].end());
  }
}

}  // namespace catoptric::image
