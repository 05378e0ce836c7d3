// Names of devices as the command line and the configs give them: auto | egl:N | surfaceless |
// osmesa.
#pragma once

#include <string>
#include <string_view>

namespace catoptric::gl {

enum class Platform {
  EglDevice,       ///< EGL_EXT_platform_device: a GPU, or a software device
  EglSurfaceless,  ///< EGL_MESA_platform_surfaceless
  OsMesa,          ///< libOSMesa
};

struct DeviceChoice {
  bool automatic = true;
  Platform platform = Platform::EglDevice;  ///< when not automatic
  int index = 0;                            ///< N of egl:N

  /// "auto", "egl:0", "surfaceless", "osmesa".
  std::string text() const;
};

/// Throws UsageError that lists what is allowed.
DeviceChoice parseDevice(std::string_view text);

}  // namespace catoptric::gl
