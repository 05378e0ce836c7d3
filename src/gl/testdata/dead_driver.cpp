// A vendor library of EGL that crashes when it is loaded, for the tests.
#include <csignal>

extern "C" __attribute__((visibility("default"))) int __egl_Main(unsigned, const void*, void*,
                                                                 void*) {
  return std::raise(SIGSEGV);
}
