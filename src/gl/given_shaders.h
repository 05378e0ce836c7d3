// The shaders of the folder that setShaderFolder() has set, for those who start other processes.
#pragma once

#include <filesystem>
#include <string>

namespace catoptric::gl {

/// The folder; empty: none was set.
const std::filesystem::path& shaderFolder();
/// A fingerprint of all shaders, with those of the folder; empty: no folder was set.
std::string givenShaders();

}  // namespace catoptric::gl
