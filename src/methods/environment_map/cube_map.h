// The cube map of environment_map: its conventions, and a cube map of the environment alone.
#pragma once

#include "core/math.h"
#include "frame/shading.h"
#include "gl/objects.h"

namespace catoptric::methods {

/// Direction (not normalized) at (s, t) in 0..1 of a cube map's face (0..5: +x -x +y -y +z -z); t
/// points downwards. The inverse of OpenGL 4.5 core, table 8.19.
Vec3 cubeDirection(int face, float s, float t);

/// Face size in texels that `environment` needs, at most `faceSize`; 1 if its radiance is constant.
int environmentFaceSize(const scene::Environment& environment, int faceSize);

/// The environment's radiance at the texel centres as RGBA32F (a = 0), with mip levels.
gl::Texture makeEnvironmentCubeMap(const frame::EnvironmentLight& environment, int faceSize);

}  // namespace catoptric::methods
