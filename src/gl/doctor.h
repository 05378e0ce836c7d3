// What `catoptric doctor` says about GL: every platform and device of this machine, tried.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gl/context.h"

namespace catoptric::gl {

struct DeviceReport {
  std::string device;  ///< as --device names it
  std::string status;  ///< "ok", "software", or "unusable"
  std::string glVersion;
  std::string renderer;
  std::vector<std::pair<std::string, std::string>> limits;  ///< name, value
  std::vector<std::string> missing;                         ///< what we need and it does not have
  std::string message;   ///< how the attempt ended, when unusable
  std::string whatToDo;  ///< empty when usable
  double seconds = 0;    ///< to make the context
  bool usable() const { return status != "unusable"; }
};

/// Tries everything; a context that is current stays so. At least the entries "egl:0" (or the
/// reason that EGL has no devices), "surfaceless" and "osmesa", in the order of `auto`.
std::vector<DeviceReport> describeDevices();

/// The reports as text for a terminal.
std::string doctorText(const std::vector<DeviceReport>& reports);

}  // namespace catoptric::gl
