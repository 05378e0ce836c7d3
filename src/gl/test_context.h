// The GL context of a test program. It is created at first use and shared by all tests of the
// process. The environment variable CATOPTRIC_DEVICE selects the device (default: auto).
#pragma once

#include <cstdlib>

#include "gl/context.h"

namespace catoptric::gl {

/// The device of CATOPTRIC_DEVICE, or "auto".
inline DeviceChoice testDevice() {
  const char* name = std::getenv("CATOPTRIC_DEVICE");
  return parseDevice(name != nullptr && *name != '\0' ? name : "auto");
}

/// Throws DeviceError if the device cannot be used: the test then fails, it is not skipped.
inline Context& testContext() {
  static Context context(testDevice());
  context.makeCurrent();
  return context;
}

}  // namespace catoptric::gl
