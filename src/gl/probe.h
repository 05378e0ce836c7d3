// Private to src/gl: tries a driver in a child process, because a driver may crash or end the
// process in which it is loaded.
#pragma once

#include <functional>
#include <string>

#include "gl/platform.h"

namespace catoptric::gl {

/// The result of `work` in a child process. Throws the PlatformFailure of `work`, or one that says
/// how the child ended without a result.
std::string inChild(const std::function<std::string()>& work);

/// Throws PlatformFailure if a child process that does `work` dies. Other failures of `work` are
/// ignored here, because `work` will fail in the same way in this process. The cache records that
/// the child survived, so that a driver is tried once for each device, machine, and environment.
void requireSurvival(const std::string& device, const std::function<void()>& work);

}  // namespace catoptric::gl
