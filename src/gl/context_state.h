// Private to src/gl: what GL objects and the doctor ask of the contexts.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "gl/api.h"
#include "gl/context.h"

namespace catoptric::gl {

/// Whether the context of this serial number still exists.
bool contextIsAlive(std::uint32_t serial);

/// The current context's vertex array without attributes.
GLuint emptyVertexArray();

struct ProbedDevice {
  DeviceInfo info;
  std::set<std::string> extensions;
};
/// Makes a context for a moment; the one that is current stays so. Throws PlatformFailure.
ProbedDevice probeDevice(Platform platform, int index);

}  // namespace catoptric::gl
