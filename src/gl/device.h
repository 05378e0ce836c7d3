// The names of devices on the command line and in configs: auto | egl:N | surfaceless | osmesa.
#pragma once

#include <string>
#include <string_view>

namespace catoptric::gl {

enum class Platform {
  EglDevice,       ///< EGL_EXT_platform_device: a GPU or a software device
  EglSurfaceless,  ///< EGL_MESA_platform_surfaceless
  OsMesa,          ///< libOSMesa
};

struct DeviceChoice {
  bool automatic = true;
  Platform platform = Platform::EglDevice;  ///< if not automatic
  int index = 0;                            ///< N of egl:N

  /// "auto", "egl:0", "surfaceless", "osmesa".
  std::string text() const;
};

/// Throws UsageError, which lists the allowed names.
DeviceChoice parseDevice(std::string_view text);

}  // namespace catoptric::gl
