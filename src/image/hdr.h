// Radiance HDR pictures (.hdr, .pic), read by ourselves: no module has to be loaded for an
// environment map, and nothing dies on a bad file.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "image/image.h"

namespace catoptric::image {

/// Whether the bytes begin as a Radiance picture does.
bool isHdr(std::span<const std::byte> bytes);

/// R G B, row 0 at the top; EXPOSURE lines are divided out, so values are radiance. Flat, old and
/// new run lengths. XYZE and rotated pictures are refused. Throws SceneError beginning with `name`.
/// [Radiance 5 "filefmts": Picture File Format]
Image decodeHdr(std::span<const std::byte> bytes, const std::string& name, std::size_t maxValues);

}  // namespace catoptric::image
