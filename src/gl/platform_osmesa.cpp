// OSMesa, Mesa's off-screen renderer without any window system.
#include <array>

#include "gl/api.h"
#include "gl/platform_library.h"

namespace catoptric::gl {
namespace {

constexpr const char* kOsMesaLibrary = "libOSMesa.so.8";

// From GL/osmesa.h (Mesa 22.3), whose package is not needed for this.
using OsMesaHandle = struct osmesa_context*;
constexpr int kOsMesaFormat = 0x22;
constexpr int kOsMesaProfile = 0x33;
constexpr int kOsMesaCoreProfile = 0x34;
constexpr int kOsMesaMajorVersion = 0x36;
constexpr int kOsMesaMinorVersion = 0x37;

struct OsMesaLibrary {
  void* handle = nullptr;
  OsMesaHandle (*create)(const int*, OsMesaHandle) = nullptr;
  GLboolean (*makeCurrent)(OsMesaHandle, void*, GLenum, GLsizei, GLsizei) = nullptr;
  void (*destroy)(OsMesaHandle) = nullptr;
  void* (*function)(const char*) = nullptr;
};

const OsMesaLibrary& osMesaLibrary() {
  static OsMesaLibrary loaded;
  if (loaded.handle != nullptr) return loaded;
  OsMesaLibrary fresh;
  void* handle =
      openLibrary(kOsMesaLibrary, "install libosmesa6 (Mesa before 25.1), or use another device");
  fresh.handle = handle;
  const auto find = [&](const char* name, auto& function) {
    findFunction(handle, kOsMesaLibrary, name, "install Mesa's libosmesa6, version 17 to 25.0",
                 function);
  };
  find("OSMesaCreateContextAttribs", fresh.create);
  find("OSMesaMakeCurrent", fresh.makeCurrent);
  find("OSMesaDestroyContext", fresh.destroy);
  find("OSMesaGetProcAddress", fresh.function);
  loaded = fresh;
  return loaded;
}

class OsMesaContext : public PlatformContext {
 public:
  OsMesaContext() : library_(osMesaLibrary()) {
    const std::array<int, 9> attributes = {kOsMesaFormat,
                                           GL_RGBA,
                                           kOsMesaProfile,
                                           kOsMesaCoreProfile,
                                           kOsMesaMajorVersion,
                                           4,
                                           kOsMesaMinorVersion,
                                           5,
                                           0};
    context_ = library_.create(attributes.data(), nullptr);
    if (context_ == nullptr) {
      throw PlatformFailure{"OSMesa cannot create an OpenGL 4.5 core context",
                            "install Mesa 20 or newer with the llvmpipe driver, and unset "
                            "GALLIUM_DRIVER and MESA_GL_VERSION_OVERRIDE"};
    }
  }
  ~OsMesaContext() override { library_.destroy(context_); }
  OsMesaContext(const OsMesaContext&) = delete;
  OsMesaContext& operator=(const OsMesaContext&) = delete;

  void makeCurrent() override {
    // OSMesa wants a default framebuffer; all drawing goes to framebuffer objects.
    if (!library_.makeCurrent(context_, pixels_.data(), GL_UNSIGNED_BYTE, kSize, kSize)) {
      throw PlatformFailure{"OSMesaMakeCurrent failed", "reinstall libosmesa6"};
    }
  }
  void release() noexcept override {
    library_.makeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
  }
  void* function(const char* name) const override { return library_.function(name); }
  std::string version() const override { return kOsMesaLibrary; }

 private:
  static constexpr int kSize = 4;
  const OsMesaLibrary& library_;
  OsMesaHandle context_ = nullptr;
  std::array<std::uint8_t, kSize * kSize * 4> pixels_{};
};

}  // namespace

std::unique_ptr<PlatformContext> makeOsMesaContext() {
  return std::make_unique<OsMesaContext>();
}

}  // namespace catoptric::gl

#ifdef __SANITIZE_ADDRESS__
// OSMesa (22.3) keeps about 1 KiB of each of its contexts' default framebuffers.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOSMesa.so\n";
}
#endif
