// The cube map of environment_map: its conventions, and the environment itself as one.
#pragma once

#include "core/math.h"
#include "frame/shading.h"
#include "gl/objects.h"

namespace catoptric::methods {

/// Direction (not normalized) of a cube map's face (0..5: +x -x +y -y +z -z) at (s, t) in 0..1,
/// t downwards: OpenGL 4.5 core, table 8.19, inverted.
Vec3 cubeDirection(int face, float s, float t);

/// Texels along a face's edge that `environment` needs, at most `faceSize`: 1 when its radiance
/// is the same everywhere.
int environmentFaceSize(const scene::Environment& environment, int faceSize);

/// The environment's radiance at the texels' centres, RGBA32F (a = 0), with mip levels.
gl::Texture makeEnvironmentCubeMap(const frame::EnvironmentLight& environment, int faceSize);

}  // namespace catoptric::methods
