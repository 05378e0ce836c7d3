#include <span>

#include "core/error.h"
#include "image/hdr.h"
#include "image/image.h"
#include "memory_file.h"

using namespace catoptric;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  try {
    if (image::isHdr(bytes)) {
      image::decodeHdr(bytes, "fuzz", std::size_t{1} << 18);
    } else if (size > 0 && data[0] == 0x76) {  // EXR's first byte
      const fuzz::MemoryFile file(data, size);
      image::readImage(file.path());
    } else {
      image::decodeImage8(bytes, "fuzz", std::size_t{1} << 16);
    }
  } catch (const Error&) {
  }
  return 0;
}
