// Programs that draw the scene's surfaces: a pass's shaders over surface.glsl, a variant for each
// set of features that objects have. Only what is drawn is compiled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "frame/shading.h"
#include "gl/shader.h"
#include "raster/scene_gpu/materials.h"

namespace catoptric::raster {

/// A pass's entry points.
struct SurfaceShaders {
  std::string label;                        ///< of the programs
  std::string vertex;                       ///< includes vertex.glsl
  std::string fragment;                     ///< includes surface.glsl
  std::uint32_t outputs = kRadianceOutput;  ///< bits of Feature
  std::vector<gl::Define> defines = {};     ///< of the pass alone
};

struct SurfaceProgram {
  gl::Program program;
  GLint uvPerMetre = -1;
  GLint objectId = -1;
};

/// All variants of a pass under one set of lights.
class PassPrograms {
 public:
  PassPrograms(SurfaceShaders shaders, const frame::Lighting& lighting);
  /// For an object with these features of its own, under a lighting with a sky or without.
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
  std::map<std::string, PassPrograms> passes_;  ///< by shaders, defines and lights
};

}  // namespace catoptric::raster
