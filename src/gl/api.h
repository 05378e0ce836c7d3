// The OpenGL 4.5 core functions, loaded at run time through the context in use (no GL library is
// linked). The only place that includes the loader that glad generates at build.
#pragma once

#include <glad/gl.h>
