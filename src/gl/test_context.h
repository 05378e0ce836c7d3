// The GL context of a test program: on the device of the environment variable CATOPTRIC_DEVICE
// (default auto), made at first use, shared by all tests of the process.
#pragma once

#include <cstdlib>

#include "gl/context.h"

namespace catoptric::gl {

/// CATOPTRIC_DEVICE or "auto".
inline DeviceChoice testDevice() {
  const char* name = std::getenv("CATOPTRIC_DEVICE");
  return parseDevice(name != nullptr && *name != '\0' ? name : "auto");
}

/// Throws DeviceError (the test fails, it does not skip) when the device cannot be had.
inline Context& testContext() {
  static Context context(testDevice());
  context.makeCurrent();
  return context;
}

}  // namespace catoptric::gl
