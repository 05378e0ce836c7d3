// The GL part of `catoptric doctor`: tries every platform and device of this machine.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gl/context.h"

namespace catoptric::gl {

struct DeviceReport {
  std::string device;  ///< in the syntax of --device
  std::string status;  ///< "ok", "software", or "unusable"
  std::string glVersion;
  std::string renderer;
  std::vector<std::pair<std::string, std::string>> limits;  ///< name and value
  std::vector<std::string> missing;  ///< required features that the device lacks
  std::string message;               ///< how the attempt ended, if unusable
  std::string whatToDo;              ///< empty if usable
  double seconds = 0;                ///< time to create the context
  bool usable() const { return status != "unusable"; }
};

/// Tries every device, each in a child process, because a driver may crash its process. The result
/// has at least the entries "egl:0" (or the reason why EGL has no devices), "surfaceless" and
/// "osmesa", in the order in which `auto` tries them.
std::vector<DeviceReport> describeDevices();

/// A report as a JSON object.
std::string deviceJson(const DeviceReport& report);
/// The reports as text for a terminal.
std::string doctorText(const std::vector<DeviceReport>& reports);

}  // namespace catoptric::gl
