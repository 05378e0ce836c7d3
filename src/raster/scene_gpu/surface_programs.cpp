#include "raster/scene_gpu/surface_programs.h"

#include <utility>

#include "raster/scene_gpu/frame_block.h"

namespace catoptric::raster {

PassPrograms::PassPrograms(SurfaceShaders shaders, const frame::Lighting& lighting)
    : shaders_(std::move(shaders)), lights_(lightDefines(lighting)) {}

SurfaceProgram& PassPrograms::of(std::uint32_t features, bool sky) {
  const std::uint32_t needed = passFeatures(litFeatures(features, sky), shaders_.outputs);
  const auto found = variants_.find(needed);
  if (found != variants_.end()) return found->second;
  std::vector<gl::Define> defines = featureDefines(needed);
  defines.insert(defines.end(), lights_.begin(), lights_.end());
  defines.push_back({"ENVIRONMENT", "0"});  // surfaces see its irradiance only
  defines.insert(defines.end(), shaders_.defines.begin(), shaders_.defines.end());
  SurfaceProgram made;
  made.program = gl::Program(
      shaders_.label,
      {.vertex = shaders_.vertex, .fragment = shaders_.fragment, .defines = std::move(defines)});
  made.uvPerMetre = made.program.location("uvPerMetre");
  made.objectId = glGetUniformLocation(made.program.id(), "objectId");
  return variants_.emplace(needed, std::move(made)).first->second;
}

PassPrograms& SurfacePrograms::of(const SurfaceShaders& shaders, const frame::Lighting& lighting) {
  std::string key = shaders.vertex + ' ' + shaders.fragment + ' ' +
                    std::to_string(shaders.outputs) + ' ' + lightSignature(lighting);
  for (const gl::Define& define : shaders.defines) key += ' ' + define.name + '=' + define.value;
  return passes_.try_emplace(key, shaders, lighting).first->second;
}

}  // namespace catoptric::raster
