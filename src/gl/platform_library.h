// Private to src/gl: loads a platform's library by name at run time, so that none is linked.
#pragma once

#include <dlfcn.h>

#include <string>

#include "gl/platform.h"

namespace catoptric::gl {

/// Loads a library and hides its symbols from other libraries. It stays loaded, because drivers
/// keep threads and thread-local state. Throws PlatformFailure.
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

/// Sets `function` to the library's function `name`. Throws PlatformFailure.
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
