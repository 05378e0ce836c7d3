// Reads Radiance HDR pictures (.hdr, .pic) without an external library. Damaged files cause errors.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "image/image.h"

namespace catoptric::image {

/// Whether the bytes begin like a Radiance picture.
bool isHdr(std::span<const std::byte> bytes);

/// Returns R G B, row 0 at the top. Values are divided by the EXPOSURE lines, so they are radiance.
/// Reads flat pixels and both run-length encodings. Refuses XYZE and rotated pictures. Throws
/// SceneError, which begins with `name`. [Radiance 5 "filefmts": Picture File Format]
Image decodeHdr(std::span<const std::byte> bytes, const std::string& name, std::size_t maxValues);

}  // namespace catoptric::image
