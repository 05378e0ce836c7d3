// Private to src/gl: how each platform creates a context and finds its functions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gl/device.h"

namespace catoptric::gl {

/// Why a device cannot be used, and what to do about it.
struct PlatformFailure {
  std::string message;
  std::string whatToDo;
};

/// A GL context of some platform; not current after creation.
class PlatformContext {
 public:
  virtual ~PlatformContext() = default;
  /// Throws PlatformFailure.
  virtual void makeCurrent() = 0;
  virtual void release() noexcept = 0;
  virtual void* function(const char* name) const = 0;
  /// Vendor and version of EGL, or the library of OSMesa.
  virtual std::string version() const = 0;
};

/// A device of EGL_EXT_device_enumeration.
struct EglDeviceEntry {
  int index = 0;
  bool software = false;    ///< EGL_MESA_device_software
  std::string description;  ///< device file, or "software"
};

/// The devices of EGL, in EGL's order. Throws PlatformFailure if EGL cannot list them.
std::vector<EglDeviceEntry> listEglDevices();

/// Creates an OpenGL 4.5 core context. Throws PlatformFailure.
std::unique_ptr<PlatformContext> makePlatformContext(Platform platform, int index);

/// The implementations for EGL and OSMesa, each in its own source file.
std::unique_ptr<PlatformContext> makeEglContext(Platform platform, int index);
std::unique_ptr<PlatformContext> makeOsMesaContext();

}  // namespace catoptric::gl
