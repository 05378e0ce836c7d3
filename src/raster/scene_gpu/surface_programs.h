// The shader programs that draw the scene's surfaces: the shaders of a pass together with
// surface.glsl, in one variant for each set of features that objects have. Only the variants that
// are drawn are compiled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frame/shading.h"
#include "gl/shader.h"
#include "raster/scene_gpu/materials.h"

namespace catoptric::raster {

/// The shader files of a pass.
struct SurfaceShaders {
  std::string label;                        ///< label of the programs
  std::string vertex;                       ///< file that includes vertex.glsl
  std::string fragment;                     ///< file that includes surface.glsl
  std::uint32_t outputs = kRadianceOutput;  ///< bits of Feature
  std::vector<gl::Define> defines = {};     ///< additional defines of this pass
};

struct SurfaceProgram {
  gl::Program program;
  GLint uvPerMetre = -1;
  GLint objectId = -1;
};

/// All variants of a pass for one set of lights.
class PassPrograms {
 public:
  PassPrograms(SurfaceShaders shaders, const frame::Lighting& lighting);
  /// The variant for an object with these features, under a lighting with or without a sky.
  SurfaceProgram& of(std::uint32_t features, bool sky);

 private:
  SurfaceShaders shaders_;
  std::vector<gl::Define> lights_;
  std::map<std::uint32_t, SurfaceProgram> variants_;
};

class SurfacePrograms {
 public:
  PassPrograms& of(const SurfaceShaders& shaders, const frame::Lighting& lighting);

 private:
  std::map<std::string, PassPrograms> passes_;  ///< keyed by shaders, defines and lights
};

}  // namespace catoptric::raster
