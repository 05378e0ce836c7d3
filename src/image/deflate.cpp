#include "image/deflate.h"

#include <new>

namespace catoptric::image {

Deflater::Deflater(int level) : compressor_(libdeflate_alloc_compressor(level)) {
  if (compressor_ == nullptr) throw std::bad_alloc();
}

std::vector<std::byte> Deflater::compressed(std::span<const std::byte> bytes, std::size_t most) {
  std::vector<std::byte> result(most);
  result.resize(libdeflate_zlib_compress(compressor_.get(), bytes.data(), bytes.size(),
                                         result.data(), result.size()));
  return result;
}

std::size_t Deflater::bound(std::size_t count) const {
  return libdeflate_zlib_compress_bound(compressor_.get(), count);
}

}  // namespace catoptric::image
