// Private to src/gl: a platform's library, loaded by name at run time so that none is linked.
#pragma once

#include <dlfcn.h>

#include <string>

#include "gl/platform.h"

namespace catoptric::gl {

/// Loads a library, its symbols hidden from others; it stays loaded, since drivers keep threads and
/// thread-local state of their own. Throws PlatformFailure.
inline void* openLibrary(const char* library, const char* whatToDo) {
  void* handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    const char* reason = dlerror();
    throw PlatformFailure{std::string("cannot load ") + library + ": " +
                              (reason != nullptr ? reason : "unknown reason"),
                          whatToDo};
  }
  return handle;
}

/// Sets `function` to the library's `name`. Throws PlatformFailure.
template <class Function>
void findFunction(void* handle, const char* library, const char* name, const char* whatToDo,
                  Function& function) {
  void* symbol = dlsym(handle, name);
  if (symbol == nullptr) {
    throw PlatformFailure{std::string(library) + " has no " + name, whatToDo};
  }
  function = reinterpret_cast<Function>(symbol);
}

}  // namespace catoptric::gl
