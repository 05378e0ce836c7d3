// Private to src/gl: queries about contexts, for GL objects and the doctor.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "gl/api.h"
#include "gl/context.h"

namespace catoptric::gl {

/// Whether the context of this serial number still exists.
bool contextIsAlive(std::uint32_t serial);

/// The vertex array without attributes that belongs to the current context.
GLuint emptyVertexArray();

struct ProbedDevice {
  DeviceInfo info;
  std::set<std::string> extensions;
};
/// For a process that ends afterwards: creates a context and leaves it open. Throws
/// PlatformFailure.
ProbedDevice probeDevice(Platform platform, int index);

}  // namespace catoptric::gl
