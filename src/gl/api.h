// The OpenGL 4.5 core functions. They are loaded at run time through the current context; no GL
// library is linked. This is the only file that includes the loader that glad generates during the
// build.
#pragma once

#include <glad/gl.h>
