// EXR's ZIP compression by libdeflate, which takes half the time of OpenEXR's zlib; private.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace catoptric::image {

/// A channel of a file and where its values lie in memory, row 0 at the top.
struct ExrChannel {
  std::string name;
  const std::byte* values = nullptr;
  std::size_t stride = 0;  ///< bytes from pixel to pixel
  std::size_t size = 0;    ///< bytes of a value: 2 (half) or 4 (float)
};

/// Completes a file that has its header and an empty table of offsets: appends the pixels in blocks
/// of 16 rows, and fills the table. [OpenEXR "OpenEXR File Layout", "Scan Line Blocks"]
void appendZipBlocks(std::vector<std::byte>& file, int width, int height,
                     std::vector<ExrChannel> channels, int level);

}  // namespace catoptric::image
