// Compression of EXR and PNG files; private.
#pragma once

#include <libdeflate.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace catoptric::image {

/// Compresses to zlib's format, by libdeflate. For one thread at a time.
class Deflater {
 public:
  /// `level` from 1 (fast) to 12 (small). Throws std::bad_alloc.
  explicit Deflater(int level);

  /// Empty if the result would exceed `most` bytes.
  std::vector<std::byte> compressed(std::span<const std::byte> bytes, std::size_t most);
  /// The most bytes that compressed() can need.
  std::size_t bound(std::size_t count) const;

 private:
  struct Free {
    void operator()(libdeflate_compressor* compressor) const {
      libdeflate_free_compressor(compressor);
    }
  };
  std::unique_ptr<libdeflate_compressor, Free> compressor_;
};

}  // namespace catoptric::image
